//! Which channel is what: layers, views, colour, alpha, depth.
//!
//! A layer is the text before a channel's last dot. In a part with the `multiView` attribute the component
//! before the last names the view ("left.R", "diffuse.left.R"), and channels without a dot belong to the
//! first view (OpenEXR's multi-view naming); in files of several parts the `view` attribute does.

use crate::exr::container::Container;
use crate::exr::selection::SampleType;
use crate::exr::text::{shown, texts};

/// One channel and what its name says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Channel {
    pub part: usize,
    pub index: usize,
    /// The full name.
    pub name: String,
    /// The text before the last dot, less the view.
    pub layer: String,
    /// The text after the last dot.
    pub base: String,
    pub view: Option<String>,
    pub sample_type: SampleType,
    /// Its part holds channels of which only some pixels are stored, which cannot be decoded.
    pub sub_sampled: bool,
    pub deep: bool,
}

/// Channels of one part, layer and view.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layer {
    pub part: usize,
    pub name: String,
    pub view: Option<String>,
    /// Indices into [`Catalogue::channels`].
    pub channels: Vec<usize>,
}

/// All channels of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Catalogue {
    pub channels: Vec<Channel>,
    pub layers: Vec<Layer>,
    pub part_names: Vec<Option<String>>,
    /// All views, the default one first.
    pub views: Vec<String>,
}

/// Names that renderers give to the whole picture.
const BEAUTY: &[&str] =
    &["beauty", "rgba", "rgb", "combined", "c", "ci", "color", "colour", "final", "finalimage", "main"];

/// Beginnings of names of layers that hold three numbers a pixel and no light.
const NOT_LIGHT: &[&str] = &[
    "crypto",
    "normal",
    "n",
    "position",
    "p",
    "pworld",
    "pref",
    "uv",
    "st",
    "velocity",
    "vector",
    "motion",
    "motionvector",
    "forward",
    "backward",
    "disparity",
    "id",
    "materialid",
    "objectid",
    "indexob",
    "indexma",
    "multimatte",
    "mask",
    "matte",
    "denoising normal",
    "vraynormals",
    "vrayvelocity",
    "vraymtlid",
    "samples",
    "variance",
];

impl Channel {
    /// Which colour the channel is: 0 red, 1 green, 2 blue.
    pub fn rgb(&self) -> Option<usize> {
        match self.base.to_ascii_lowercase().as_str() {
            "r" | "red" => Some(0),
            "g" | "green" => Some(1),
            "b" | "blue" => Some(2),
            _ => None,
        }
    }

    pub fn is_alpha(&self) -> bool {
        matches!(self.base.to_ascii_lowercase().as_str(), "a" | "alpha")
    }

    pub fn is_luminance(&self) -> bool {
        self.base == "Y"
    }
}

/// The last component of a layer's name, in lower case.
fn last(name: &str) -> String {
    name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase()
}

fn says_depth(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.contains("depth") || last(&name) == "z" || last(&name) == "zbuffer"
}

fn is_not_light(name: &str) -> bool {
    let name = last(name);
    NOT_LIGHT.iter().any(|&start| {
        // Short names must match whole, long ones may go on ("CryptoMaterial00", "normals").
        name == start || (start.len() > 3 && name.starts_with(start))
    })
}

impl Catalogue {
    pub fn of(container: &Container) -> Self {
        let mut all = Self { channels: vec![], layers: vec![], part_names: vec![], views: vec![] };
        for (part, p) in container.parts.iter().enumerate() {
            all.part_names.push(p.text("name"));
            let part_view = p.text("view");
            let part_views = p
                .attribute("multiView")
                .filter(|a| a.kind == "stringvector")
                .map(|a| texts(&a.bytes))
                .unwrap_or_default();
            for view in part_views.iter().chain(&part_view) {
                if !all.views.contains(view) {
                    all.views.push(view.clone());
                }
            }
            let sub_sampled = p.header.channels.list.iter().any(|c| c.sampling != exr::math::Vec2(1, 1));
            for (index, channel) in p.header.channels.list.iter().enumerate() {
                let name = shown(channel.name.as_slice());
                let mut components: Vec<&str> = name.split('.').collect();
                let base = components.pop().unwrap_or_default().to_owned();
                let mut view = part_view.clone();
                if components.is_empty() {
                    view = view.or_else(|| part_views.first().cloned());
                } else if let Some(own) = components.last().filter(|c| part_views.iter().any(|v| v == *c)) {
                    view = Some((*own).to_owned());
                    components.pop();
                }
                let layer = components.join(".");
                let id = all.channels.len();
                match all.layers.iter_mut().find(|l| l.part == part && l.name == layer && l.view == view) {
                    Some(known) => known.channels.push(id),
                    None => all.layers.push(Layer {
                        part,
                        name: layer.clone(),
                        view: view.clone(),
                        channels: vec![id],
                    }),
                }
                all.channels.push(Channel {
                    part,
                    index,
                    layer,
                    base,
                    view,
                    sample_type: match channel.sample_type {
                        exr::meta::attribute::SampleType::F16 => SampleType::Half,
                        exr::meta::attribute::SampleType::F32 => SampleType::Float,
                        exr::meta::attribute::SampleType::U32 => SampleType::Uint,
                    },
                    sub_sampled,
                    deep: p.header.deep,
                    name,
                });
            }
        }
        all
    }

    /// A part's name, or its number where it has none.
    pub fn part_name(&self, part: usize) -> String {
        self.part_names.get(part).cloned().flatten().unwrap_or_else(|| part.to_string())
    }

    /// The channel's name as a user gives it: with its part where there are several.
    pub fn full_name(&self, channel: &Channel) -> String {
        match self.part_names.len() {
            1 => channel.name.clone(),
            _ => format!("{}:{}", self.part_name(channel.part), channel.name),
        }
    }

    /// The layer's name as a user gives it.
    pub fn layer_name(&self, layer: &Layer) -> String {
        match (&self.part_names[layer.part], layer.name.as_str()) {
            (Some(part), "") if self.part_names.len() > 1 => part.clone(),
            (_, "") => "rgba".to_owned(),
            (_, name) => name.to_owned(),
        }
    }

    fn of_layer<'a>(&'a self, layer: &'a Layer) -> impl Iterator<Item = (usize, &'a Channel)> {
        layer.channels.iter().map(|&id| (id, &self.channels[id]))
    }

    /// Red, green and blue, luminance, or nothing of the kind; then alpha.
    pub fn colours(&self, layer: &Layer) -> (Vec<usize>, Option<usize>) {
        let mut rgb = [None; 3];
        let (mut luminance, mut alpha) = (None, None);
        for (id, channel) in self.of_layer(layer) {
            if let Some(colour) = channel.rgb() {
                rgb[colour].get_or_insert(id);
            } else if channel.is_alpha() {
                alpha.get_or_insert(id);
            } else if channel.is_luminance() {
                luminance.get_or_insert(id);
            }
        }
        let colours: Vec<usize> = rgb.into_iter().flatten().collect();
        // Luminance counts where it stands alone; beside RGB it is some other number.
        (if colours.is_empty() { luminance.into_iter().collect() } else { colours }, alpha)
    }

    /// Luminance with colour differences, stored for some of the pixels.
    pub fn is_chroma(&self, layer: &Layer) -> bool {
        self.of_layer(layer).any(|(_, channel)| matches!(channel.base.as_str(), "RY" | "BY"))
    }

    /// The name of the layer's part without its view: "rgba" of "rgba_right" or "rgba.right".
    fn part_stem(&self, layer: &Layer) -> &str {
        let part = self.part_names[layer.part].as_deref().unwrap_or_default();
        match &layer.view {
            Some(view) => part.strip_suffix(view.as_str()).unwrap_or(part).trim_end_matches(['.', '_', '-']),
            None => part,
        }
    }

    /// How much like the whole picture a layer is; 0 is most, none is not at all.
    fn beauty_rank(&self, layer: &Layer) -> Option<u8> {
        let (colours, _) = self.colours(layer);
        let named = |name: &str| BEAUTY.contains(&last(name).as_str());
        let part = self.part_stem(layer);
        if says_depth(&layer.name) || (layer.name.is_empty() && says_depth(part)) {
            return None;
        }
        let odd = is_not_light(if layer.name.is_empty() { part } else { &layer.name });
        match (colours.len(), layer.name.is_empty()) {
            (3, true) if part.is_empty() || named(part) => Some(0),
            (3, false) if named(&layer.name) => Some(1),
            (3, true) if !odd => Some(2),
            (3, false) if !odd => Some(3),
            (1.., _) if !odd => Some(4),
            (0, _) if layer.channels.len() == 1 && !odd => {
                let channel = &self.channels[layer.channels[0]];
                (self.depth_rank(channel, layer).is_none() && !channel.is_alpha()).then_some(5)
            }
            (3, _) => Some(6),
            _ => None,
        }
    }

    /// The layer that is the whole picture, among those for which `wanted` holds.
    pub fn beauty(&self, wanted: impl Fn(&Layer) -> bool) -> Option<&Layer> {
        self.layers
            .iter()
            .filter(|layer| wanted(layer))
            .filter_map(|layer| self.beauty_rank(layer).map(|rank| (rank, layer)))
            .min_by_key(|&(rank, _)| rank)
            .map(|(_, layer)| layer)
    }

    /// Whether a pattern with a wildcard takes the layer: light, not data.
    pub fn is_light(&self, layer: &Layer) -> bool {
        self.beauty_rank(layer).is_some_and(|rank| rank <= 4)
    }

    /// How likely a channel is depth; 0 is most, none is not at all.
    fn depth_rank(&self, channel: &Channel, layer: &Layer) -> Option<u8> {
        let base = channel.base.to_ascii_lowercase();
        let sibling = |name: &str| self.of_layer(layer).any(|(_, c)| c.base.eq_ignore_ascii_case(name));
        let part = self.part_names[channel.part].as_deref().unwrap_or_default();
        let depth_layer = says_depth(&channel.layer) || (channel.layer.is_empty() && says_depth(part));
        // X, Y, Z are a vector: a normal or a position.
        let vector = sibling("x") || sibling("u");
        match base.as_str() {
            "z" if vector => None,
            "z" if channel.layer.is_empty() => Some(0),
            "z" if BEAUTY.contains(&last(&channel.layer).as_str()) => Some(1),
            "z" if depth_layer => Some(2),
            "v" if depth_layer && !vector => Some(3),
            "z" => Some(4),
            "r" | "red" | "y" | "depth" | "zdepth" if depth_layer => Some(5),
            "depth" | "zdepth" => Some(6),
            "t" if !vector && layer.channels.len() <= 2 => Some(7),
            _ => None,
        }
    }

    /// Channels that may hold depth, the likeliest first, among those for which `wanted` holds.
    pub fn depths(&self, near_part: Option<usize>, wanted: impl Fn(&Channel) -> bool) -> Vec<&Channel> {
        let mut found: Vec<(u8, bool, &Channel)> = self
            .layers
            .iter()
            .flat_map(|layer| self.of_layer(layer).map(move |(_, channel)| (layer, channel)))
            .filter(|(_, channel)| wanted(channel))
            .filter_map(|(layer, channel)| {
                let rank = self.depth_rank(channel, layer)?;
                Some((rank, near_part.is_some_and(|part| part != channel.part), channel))
            })
            .collect();
        found.sort_by_key(|&(rank, elsewhere, _)| (rank, elsewhere));
        found.into_iter().map(|(_, _, channel)| channel).collect()
    }

    /// Whether the part's name or number is this one.
    pub fn is_part(&self, part: usize, wanted: &str) -> bool {
        self.part_names[part].as_deref() == Some(wanted) || wanted.parse() == Ok(part)
    }

    /// Channels with this name: its full one, "part:channel" or "part.channel".
    pub fn named(&self, wanted: &str) -> Vec<&Channel> {
        let fits = |channel: &&Channel| {
            channel.name == wanted || {
                wanted.strip_suffix(channel.name.as_str()).is_some_and(|part| {
                    part.strip_suffix([':', '.']).is_some_and(|part| self.is_part(channel.part, part))
                })
            }
        };
        self.channels.iter().filter(fits).collect()
    }

    /// Whether a user's name or pattern means this layer.
    pub fn matches(&self, layer: &Layer, pattern: &str) -> bool {
        let part = self.part_names[layer.part].as_deref().unwrap_or_default();
        let mut names = vec![self.layer_name(layer)];
        if layer.name.is_empty() {
            names.push(self.part_stem(layer).to_owned());
            if self.beauty_rank(layer) == Some(0) {
                names.extend(["rgba", "rgb", "RGBA", "beauty"].map(str::to_owned));
            }
        } else {
            names.push(format!("{part}.{}", layer.name));
            names.push(format!("{part}:{}", layer.name));
        }
        if self.part_names.len() > 1 {
            names.push(part.to_owned());
        }
        names.iter().any(|name| glob(pattern, name))
    }
}

/// Whether `name` fits `pattern`, where `*` is any text and `?` any one character.
pub(crate) fn glob(pattern: &str, name: &str) -> bool {
    let (p, n): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut i, mut j) = (0, 0);
    // Where the last `*` was, and how much of the name it took.
    let mut star: Option<(usize, usize)> = None;
    while j < n.len() {
        if i < p.len() && p[i] == '*' {
            star = Some((i, j));
            i += 1;
        } else if i < p.len() && (p[i] == '?' || p[i] == n[j]) {
            i += 1;
            j += 1;
        } else if let Some((at, taken)) = star {
            star = Some((at, taken + 1));
            (i, j) = (at + 1, taken + 1);
        } else {
            return false;
        }
    }
    p[i..].iter().all(|&c| c == '*')
}

#[cfg(test)]
mod tests {
    use super::glob;

    #[test]
    fn patterns_match_as_in_a_shell() {
        for (pattern, name, fits) in [
            ("*", "", true),
            ("light_*", "light_key", true),
            ("light_?", "light_key", false),
            ("*key*", "light_key_2", true),
            ("a*b*c", "axxbyyc", true),
            ("a*b*c", "axxbyy", false),
            ("diffuse", "diffuse2", false),
        ] {
            assert_eq!(glob(pattern, name), fits, "{pattern} {name}");
        }
    }
}
