// Sprites in the shape of an outline: rows cut into slices whose ends slope; the CPU's `bokeh::shape` has the theory.
//
// `shape` holds two extents (top, bottom, the columns of both tips), behind focus and in front, then the sides of each:
// k, m dx, m dy, a of the line k (x^2 + y^2 + a^2) + m (x dx + y dy) = a, which is an arc of radius 1 / (2 k), or straight
// where k is 0. All in diameters.
alias ShapePx = vec4f;

const AT_TIPS: u32 = 4u;
// Steps by which tips are found: f32 sees no more.
const STEPS: u32 = 24u;
const FAR: f32 = 1e30;
// From so many rows on a sum of slices is the area.
const EXACT_FROM: f32 = 256.0;

struct Extent {
    top: f32,
    bottom: f32,
    tips: vec2f,
    // A second disc that cuts the aperture: its centre, and its radius or 0.
    cut: vec3f,
}

struct Sprite {
    front: u32,
    diameter: f32,
    extent: Extent,
}

struct Slice {
    height: f32,
    // Of either end the mean place, and half of how far it slopes.
    low: vec2f,
    high: vec2f,
}

fn unit_of(s: Sprite) -> vec2f { return vec2f(p.unit_x, p.unit_y) * s.diameter; }

fn extent_of(front: u32) -> Extent {
    let e = shape[front];
    return Extent(e.x, e.y, e.zw, vec3f(0.0));
}

// Where the line `y` runs inside the outline and the cut; the second end before the first where it does not.
fn ends(front: u32, cut: vec3f, y: f32) -> vec2f {
    var low = -FAR;
    var high = FAR;
    if cut.z > 0.0 {
        let square = cut.z * cut.z - (y - cut.y) * (y - cut.y);
        if square < 0.0 { return vec2f(FAR, -FAR); }
        low = cut.x - sqrt(square);
        high = cut.x + sqrt(square);
    }
    for (var i = 0u; i < p.sides; i++) {
        let side = shape[2u + front * p.sides + i];
        let c = side.x * (y * y + side.w * side.w) + side.z * y - side.w;
        let square = side.y * side.y - 4.0 * side.x * c;
        if square < 0.0 { return vec2f(FAR, -FAR); }
        let root = abs(side.y) + sqrt(square);
        if root == 0.0 {
            // Beyond a straight side or within it; or where a line touches an arc.
            if c > 0.0 { return vec2f(FAR, -FAR); }
            if side.x > 0.0 {
                low = max(low, 0.0);
                high = min(high, 0.0);
            }
            continue;
        }
        // Both roots without a difference of what is nearly alike.
        let near = 2.0 * c / root;
        let away = select(FAR, root / (2.0 * side.x), side.x > 0.0);
        if side.y >= 0.0 {
            low = max(low, -away);
            high = min(high, -near);
        } else {
            low = max(low, near);
            high = min(high, away);
        }
    }
    return vec2f(low, high);
}

// The line `y` of an extent, which is its tip where rounding finds nothing.
fn line(s: Sprite, y: f32) -> vec2f {
    let found = ends(s.front, s.extent.cut, y);
    let tip = select(s.extent.tips.x, s.extent.tips.y, y > 0.5 * (s.extent.top + s.extent.bottom));
    return select(vec2f(tip), found, found.x <= found.y);
}

// Where the outline, cut by a second disc, ends on the way from a line inside to one outside: the line and its column.
fn tip_of(front: u32, cut: vec3f, within: f32, beyond: f32) -> vec2f {
    var inside = within;
    var outside = beyond;
    for (var i = 0u; i < STEPS; i++) {
        let middle = 0.5 * (inside + outside);
        let found = ends(front, cut, middle);
        if found.x <= found.y { inside = middle; } else { outside = middle; }
    }
    let found = ends(front, cut, inside);
    return vec2f(inside, select(0.0, 0.5 * (found.x + found.y), found.x <= found.y));
}

fn extent_cut(front: u32, displacement: vec2f) -> Extent {
    let all = extent_of(front);
    if displacement.x == 0.0 && displacement.y == 0.0 { return all; }
    let cut = vec3f(displacement, p.reach);
    // Half way to the second disc's centre lies inside every outline.
    let inside = 0.5 * cut.y;
    let top = tip_of(front, cut, inside, max(cut.y - cut.z, all.top) - 1e-6);
    let bottom = tip_of(front, cut, inside, min(cut.y + cut.z, all.bottom) + 1e-6);
    return Extent(top.x, bottom.x, vec2f(top.y, bottom.y), cut);
}

// The same, where `extent_cut` found it before.
fn extent_found(front: u32, displacement: vec2f, found: vec4f) -> Extent {
    let there = displacement.x != 0.0 || displacement.y != 0.0;
    return Extent(found.x, found.y, found.zw, vec3f(displacement, select(0.0, p.reach, there)));
}

// What a row whose middle lies `row` pixels below the sprite's has of the upper half, from its tip, and of the lower.
fn halves(s: Sprite, row: f32) -> vec4f {
    let per_row = 1.0 / unit_of(s).y;
    let first = max((row - 0.5) * per_row, s.extent.top);
    let last = min((row + 0.5) * per_row, s.extent.bottom);
    let middle = 0.5 * (s.extent.top + s.extent.bottom);
    return vec4f(first, min(last, middle), last, max(first, middle));
}

fn is_there(part: vec2f, half: u32) -> bool { return select(part.y > part.x, part.y < part.x, half == 1u); }

fn tip(s: Sprite, half: u32) -> f32 { return select(s.extent.top, s.extent.bottom, half == 1u); }

// Around a tip, where ends move as the root of the way from it, a row has several slices.
fn slice_count(s: Sprite, part: vec2f, half: u32) -> u32 {
    return select(1u, AT_TIPS, abs(part.x - tip(s, half)) * unit_of(s).y < 1.0);
}

fn slice(s: Sprite, part: vec2f, half: u32, count: u32, number: u32) -> Slice {
    var lines = part;
    if count > 1u {
        let origin = tip(s, half);
        let toward = select(1.0, -1.0, half == 1u);
        let roots = sqrt(abs(part - origin));
        let at = mix(vec2f(roots.x), vec2f(roots.y), vec2f(f32(number), f32(number + 1u)) / f32(AT_TIPS));
        lines = origin + toward * at * at;
        if number == 0u { lines.x = part.x; }
        if number + 1u == count { lines.y = part.y; }
    }
    let unit = unit_of(s);
    let begin = line(s, lines.x);
    let between = line(s, 0.5 * (lines.x + lines.y));
    let end = line(s, lines.y);
    // Simpson's rule.
    let mean = (begin + 4.0 * between + end) * (unit.x / 6.0);
    let slope = abs(end - begin) * (0.5 * unit.x);
    return Slice(abs(lines.y - lines.x) * unit.y, vec2f(mean.x, slope.x), vec2f(mean.y, slope.y));
}

fn until(u: f32) -> f32 {
    let inside = clamp(u, 0.0, 1.0);
    return 0.5 * inside * inside + max(u - 1.0, 0.0);
}

// Which part of a column, whose right edge is `edge`, lies right of an end that slopes: the mean of what a straight end leaves.
fn right_of(edge: f32, end: vec2f) -> f32 {
    let most = edge - (end.x - end.y);
    let least = edge - (end.x + end.y);
    if most <= 0.0 { return 0.0; }
    if least >= 1.0 { return 1.0; }
    // No differences of what is nearly alike: a light is a thousand times as bright as what is beside it.
    if least >= 0.0 {
        if most <= 1.0 { return edge - end.x; }
        return 1.0 - (1.0 - least) * (1.0 - least) * (0.25 / end.y);
    }
    if most <= 1.0 { return most * most * (0.25 / end.y); }
    return clamp((until(most) - until(least)) * (0.5 / end.y), 0.0, 1.0);
}

fn covered_by(low: vec2f, high: vec2f, height: f32, column: i32) -> f32 {
    let edge = f32(column) + 0.5;
    return height * (right_of(edge, low) - right_of(edge, high));
}

// Rows and columns that a sprite reaches to either side, at most.
fn reach_of(diameter: f32) -> vec2i {
    return vec2i(p.reach * diameter * vec2f(p.unit_x, p.unit_y) + vec2f(1.5));
}

// A row of a sprite: both ends and the height where it has one slice, a height of 0 where it has none, and of -1 where
// only `covered_slowly` knows.
struct Strip {
    ends: vec4f,
    height: f32,
}

fn strip(s: Sprite, row: i32) -> Strip {
    if s.diameter < p.point { return Strip(vec4f(-0.5, 0.0, 0.5, 0.0), select(0.0, 1.0, row == 0)); }
    let parts = halves(s, f32(row));
    let upper = is_there(parts.xy, 0u);
    let lower = is_there(parts.zw, 1u);
    if !upper && !lower { return Strip(vec4f(0.0), 0.0); }
    let half = select(1u, 0u, upper);
    let part = select(parts.zw, parts.xy, upper);
    if (upper && lower) || slice_count(s, part, half) > 1u { return Strip(vec4f(0.0), -1.0); }
    let only = slice(s, part, half, 1u, 0u);
    return Strip(vec4f(only.low, only.high), only.height);
}

fn covered_slowly(s: Sprite, row: i32, column: i32) -> f32 {
    let reach = p.reach * s.diameter * p.unit_x + 1.0;
    if abs(f32(column)) > reach { return 0.0; }
    let parts = halves(s, f32(row));
    var sum = 0.0;
    for (var half = 0u; half < 2u; half++) {
        let part = select(parts.xy, parts.zw, half == 1u);
        if !is_there(part, half) { continue; }
        let count = slice_count(s, part, half);
        for (var i = 0u; i < count; i++) {
            let own = slice(s, part, half, count, i);
            sum += covered_by(own.low, own.high, own.height, column);
        }
    }
    return sum;
}

// The sum of all that a sprite covers, in pixels, uncut.
fn area_of(diameter: f32) -> f32 {
    let unit = vec2f(p.unit_x, p.unit_y) * diameter;
    if diameter < p.point { return 1.0; }
    if unit.y > EXACT_FROM { return p.area * unit.x * unit.y; }
    let s = Sprite(0u, diameter, extent_of(0u));
    let reach = i32(p.reach * unit.y + 0.5);
    var area = 0.0;
    for (var row = -reach; row <= reach; row++) {
        let parts = halves(s, f32(row));
        for (var half = 0u; half < 2u; half++) {
            let part = select(parts.xy, parts.zw, half == 1u);
            if !is_there(part, half) { continue; }
            let count = slice_count(s, part, half);
            for (var i = 0u; i < count; i++) {
                let own = slice(s, part, half, count, i);
                area += own.height * (own.high.x - own.low.x);
            }
        }
    }
    return area;
}
