//! Loops written out, so that arrays that are indexed in them are registers for every driver, whatever it unrolls itself.
//!
//! A loop is marked in the shader: `/* unroll */ for (var j = 0u; j < K; j++) { ... }`. Its bounds are numbers, constants of
//! the kernel, or such a constant less a number; `j += STEP` is known, too. Each turn becomes a block that begins with `const j
//! = 3u;`. Loops whose bounds are not known stay as they are.

use std::collections::HashMap;

const MARK: &str = "/* unroll */ for (var ";

/// Writes out the marked loops of a shader.
pub fn unrolled(text: &str, constants: &HashMap<&str, u32>) -> String {
    let Some(at) = text.find(MARK) else { return text.to_owned() };
    let (before, rest) = text.split_at(at);
    let head = rest.find('{').map(|end| &rest[MARK.len()..end]);
    let Some((head, body, after)) = head.and_then(|head| {
        let open = MARK.len() + head.len();
        let close = open + matching(&rest[open..])?;
        Some((Head::parse(head, constants)?, &rest[open + 1..close], &rest[close + 1..]))
    }) else {
        // Not a loop that can be written out; go on behind its mark.
        let (mark, after) = rest.split_at(MARK.len());
        return format!("{before}{mark}{}", unrolled(after, constants));
    };
    let body = unrolled(body, constants);
    let mut out = before.to_owned();
    let mut value = head.first;
    while value < head.end {
        out.push_str(&format!("{{ const {} = {value}u;{body}}}\n", head.name));
        value += head.step;
    }
    out.push_str(&unrolled(after, constants));
    out
}

/// Where the brace that opens `text` is closed.
fn matching(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                if depth == 0 {
                    return Some(at);
                }
            }
            _ => {}
        }
    }
    None
}

/// `j = 0u; j < K; j++) `, read.
struct Head<'a> {
    name: &'a str,
    first: u32,
    end: u32,
    step: u32,
}

impl<'a> Head<'a> {
    fn parse(text: &'a str, constants: &HashMap<&str, u32>) -> Option<Self> {
        let mut parts = text.trim().strip_suffix(')')?.split(';');
        let (name, first) = parts.next()?.split_once('=')?;
        let name = name.trim();
        let end = parts.next()?.trim().strip_prefix(name)?.trim().strip_prefix('<')?;
        let onward = parts.next()?.trim().strip_prefix(name)?.trim();
        let step = match onward.strip_prefix("+=") {
            Some(step) => value(step, constants)?,
            None if onward == "++" => 1,
            None => return None,
        };
        let head = Self { name, first: value(first, constants)?, end: value(end, constants)?, step };
        (head.step > 0).then_some(head)
    }
}

/// A number, a constant, or a difference of two such.
fn value(text: &str, constants: &HashMap<&str, u32>) -> Option<u32> {
    let text = text.trim();
    if let Some((a, b)) = text.split_once('-') {
        return value(a, constants)?.checked_sub(value(b, constants)?);
    }
    text.strip_suffix('u').and_then(|number| number.parse().ok()).or_else(|| constants.get(text).copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_are_written_out() {
        let constants = HashMap::from([("K", 4), ("STEP", 2)]);
        let of = |text: &str| unrolled(text, &constants);
        let two = "a; /* unroll */ for (var j = 0u; j < K; j += STEP) { b(j); if x { c; } } d;";
        assert_eq!(
            of(two),
            "a; { const j = 0u; b(j); if x { c; } }\n{ const j = 2u; b(j); if x { c; } }\n d;"
        );
        let inner = "/* unroll */ for (var i = 1u; i < STEP; i++) { /* unroll */ for (var j = 0u; j < K - 3u; j++) { e(i, j); } }";
        assert_eq!(of(inner), "{ const i = 1u; { const j = 0u; e(i, j); }\n }\n");
        // Unknown bounds and plain loops stay.
        for same in
            ["/* unroll */ for (var j = 0u; j < N; j++) { f(j); }", "for (var j = 0u; j < K; j++) { g; }"]
        {
            assert_eq!(of(same), same);
        }
        assert_eq!(of("/* unroll */ for (var j = 4u; j < K; j++) { h; }k"), "k");
    }
}
