// Sprites in the shape of a picture: `shape` holds the sums of all its pixels above and to the left of each corner, as whole
// numbers, so that what lies in any rectangle is exact; the CPU's `Pictures` has the theory.
alias ShapePx = u32;

// Lines of a row on which a second disc's ends are found.
const LINES: u32 = 4u;

struct Extent {
    top: f32,
    bottom: f32,
    tips: vec2f,
    cut: vec3f,
}

struct Sprite {
    front: u32,
    diameter: f32,
    extent: Extent,
}

fn extent_of(front: u32) -> Extent { return Extent(0.0, 0.0, vec2f(0.0), vec3f(0.0)); }

fn extent_cut(front: u32, displacement: vec2f) -> Extent {
    let there = displacement.x != 0.0 || displacement.y != 0.0;
    return Extent(0.0, 0.0, vec2f(0.0), vec3f(displacement, select(0.0, p.reach, there)));
}

fn extent_found(front: u32, displacement: vec2f, found: vec4f) -> Extent { return extent_cut(front, displacement); }

// Pixels of the picture for each pixel across and down.
fn scale_of(diameter: f32) -> vec2f { return p.longer_side / (vec2f(p.unit_x, p.unit_y) * diameter); }

fn reach_of(diameter: f32) -> vec2i {
    if diameter < p.point { return vec2i(0); }
    let half = 0.5 * vec2f(f32(p.columns - 1u), f32(p.rows - 1u));
    return vec2i(ceil(half / scale_of(diameter) + vec2f(0.5)));
}

fn covered_by(low: vec2f, high: vec2f, height: f32, column: i32) -> f32 { return select(0.0, height, column == 0); }

struct Strip {
    ends: vec4f,
    height: f32,
}

fn strip(s: Sprite, row: i32) -> Strip {
    if s.diameter < p.point { return Strip(vec4f(0.0), select(0.0, 1.0, row == 0)); }
    return Strip(vec4f(0.0), select(0.0, -1.0, abs(row) <= reach_of(s.diameter).y));
}

fn sum_at(x: u32, y: u32) -> u32 { return shape[y * p.columns + x]; }

// The sum of a rectangle between whole corners; negative where they are the wrong way round.
fn rectangle(left: u32, right: u32, top: u32, bottom: u32) -> f32 {
    let sum = sum_at(right, bottom) - sum_at(left, bottom) - sum_at(right, top) + sum_at(left, top);
    return f32(bitcast<i32>(sum));
}

fn covered_slowly(s: Sprite, row: i32, column: i32) -> f32 {
    // In front of focus it is turned by half a turn.
    let turned = select(vec2i(column, row), vec2i(-column, -row), s.front == 1u);
    let scale = scale_of(s.diameter);
    let most = vec2f(f32(p.columns - 1u), f32(p.rows - 1u));
    let first = clamp(0.5 * most + (vec2f(turned) - 0.5) * scale, vec2f(0.0), most);
    let last = clamp(0.5 * most + (vec2f(turned) + 0.5) * scale, vec2f(0.0), most);
    let low = min(vec2u(first), vec2u(most) - 1u);
    let high = min(vec2u(last), vec2u(most) - 1u);
    let after = first - vec2f(low);
    let over = last - vec2f(high);
    // Between corners sums are mixed along each axis.
    let parts = vec4f(after.x, over.x, after.y, over.y);
    var sum = 0.0;
    for (var i = 0u; i < 16u; i++) {
        let next = vec4u(i & 1u, (i >> 1u) & 1u, (i >> 2u) & 1u, i >> 3u);
        let part = select(vec4f(1.0) - parts, parts, next == vec4u(1u));
        let all = rectangle(low.x + next.x, high.x + next.y, low.y + next.z, high.y + next.w);
        sum += part.x * part.y * part.z * part.w * all;
    }
    sum = max(sum, 0.0);
    let cut = s.extent.cut;
    if cut.z == 0.0 { return sum; }
    var through = 0.0;
    for (var i = 0u; i < LINES; i++) {
        let y = (f32(row) - 0.5 + (f32(i) + 0.5) / f32(LINES)) / (p.unit_y * s.diameter);
        let square = cut.z * cut.z - (y - cut.y) * (y - cut.y);
        if square < 0.0 { continue; }
        let ends = (cut.x + vec2f(-1.0, 1.0) * sqrt(square)) * (p.unit_x * s.diameter);
        through += max(min(ends.y, f32(column) + 0.5) - max(ends.x, f32(column) - 0.5), 0.0);
    }
    return sum * through / f32(LINES);
}

// The sum of all of a sprite.
fn area_of(diameter: f32) -> f32 { return select(p.area, 1.0, diameter < p.point); }
