//! Which channels a selection means.

use crate::error::{FileError, FileResult};
use crate::exr::document::Document;
use crate::exr::names::{Channel, Layer};
use crate::exr::selection::Selection;
use std::path::Path;

/// The chosen channels, as indices into the catalogue.
pub(crate) struct Chosen {
    pub layers: Vec<Layer>,
    pub colors: Vec<usize>,
    pub alpha: Option<usize>,
    pub view: Option<String>,
}

impl Chosen {
    /// Adds what is not chosen yet.
    fn add(&mut self, layer: &Layer, (colors, alpha): (Vec<usize>, Option<usize>)) {
        if !self.layers.contains(layer) {
            self.layers.push(layer.clone());
        }
        for color in colors {
            self.add_color(color);
        }
        match (alpha, self.alpha) {
            (Some(alpha), None) => {
                self.colors.retain(|&color| color != alpha);
                self.alpha = Some(alpha);
            }
            (Some(alpha), Some(_)) => self.add_color(alpha),
            (None, _) => {}
        }
    }

    fn add_color(&mut self, channel: usize) {
        if !self.colors.contains(&channel) && self.alpha != Some(channel) {
            self.colors.push(channel);
        }
    }
}

impl Document {
    /// Channels that may hold depth for a view, the likeliest first.
    pub(crate) fn find_depths(&self, near_part: Option<usize>, view: Option<&str>) -> Vec<&Channel> {
        self.catalogue.depths(near_part, |channel| {
            !channel.deep
                && !channel.sub_sampled
                && (channel.view.is_none() || channel.view.as_deref() == view)
        })
    }

    /// Channels of this name in the chosen part, or in all of them where the name says its part itself. The same name in several
    /// parts: the one for this eye, then the first.
    fn named(&self, name: &str, view: Option<&str>, part: Option<&str>) -> Vec<&Channel> {
        let mut found = self.catalogue.named(name);
        found.retain(|channel| {
            channel.name != name || part.is_none_or(|part| self.catalogue.is_part(channel.part, part))
        });
        found.sort_by_key(|channel| channel.view.as_deref() != view);
        found
    }

    pub(crate) fn named_channel(
        &self,
        name: &str,
        view: Option<&str>,
        part: Option<&str>,
    ) -> FileResult<&Channel> {
        self.named(name, view, part).first().copied().ok_or_else(|| FileError::NotFound {
            file: self.path().to_owned(),
            what: match part {
                Some(part) => format!("channel '{name}' in part '{part}'"),
                None => format!("channel '{name}'"),
            },
            available: self.all_channels(),
        })
    }

    /// The names of all channels, for a message.
    fn all_channels(&self) -> String {
        listed(self.catalogue.channels.iter().map(|channel| self.catalogue.full_name(channel)))
    }

    /// Refuses a file whose layers are deep or stored for some of the pixels: why nothing was found in it.
    fn check_flat(&self, wanted: impl Fn(&Layer) -> bool) -> FileResult<()> {
        let catalogue = &self.catalogue;
        let is_deep = |layer: &Layer| self.container.parts[layer.part].header.deep;
        if catalogue.layers.iter().any(|layer| wanted(layer) && is_deep(layer)) {
            return Err(deep(self.path()));
        }
        match catalogue.layers.iter().find(|layer| catalogue.is_chroma(layer)) {
            Some(layer) => self.check_channel(&catalogue.channels[layer.channels[0]]),
            None => Ok(()),
        }
    }

    /// The channel that holds depth, for a file of which nothing else is wanted: the one that is named, else the likeliest, else the
    /// one grey channel of a file that has no other picture, whatever its name.
    pub(crate) fn depth_alone(&self, selection: &Selection) -> FileResult<Option<&Channel>> {
        let anything = Selection { layers: Vec::new(), color_optional: true, ..selection.clone() };
        let chosen = self.choose_layers(&anything)?;
        let (view, part) = (chosen.view.as_deref(), selection.part.as_deref());
        if let Some(name) = &selection.depth_channel {
            return self.named_channel(name, view, part).map(Some);
        }
        let near = chosen.layers.first().map(|layer| layer.part);
        let mut found = self.find_depths(near, view);
        found.retain(|channel| part.is_none_or(|part| self.catalogue.is_part(channel.part, part)));
        match (found.first(), chosen.colors.as_slice()) {
            (Some(channel), _) => Ok(Some(channel)),
            (None, &[grey]) => Ok(Some(&self.catalogue.channels[grey])),
            (None, _) => {
                self.check_flat(|layer| part.is_none_or(|part| self.catalogue.is_part(layer.part, part)))?;
                Ok(None)
            }
        }
    }

    /// The part that a picture lies in: that of its first layer, else that of its depth or circles of confusion.
    pub(crate) fn first_part(
        &self,
        chosen: &Chosen,
        coc: Option<&Channel>,
        selection: &Selection,
    ) -> FileResult<usize> {
        if let Some(layer) = chosen.layers.first() {
            return Ok(layer.part);
        }
        let channel = match coc {
            Some(channel) => Some(channel),
            None => self.depth_alone(selection)?,
        };
        channel.map(|channel| channel.part).ok_or_else(|| FileError::NotFound {
            file: self.path().to_owned(),
            what: "colour layer and no depth channel".to_owned(),
            available: self.all_channels(),
        })
    }

    pub(crate) fn choose_layers(&self, selection: &Selection) -> FileResult<Chosen> {
        let catalogue = &self.catalogue;
        let missing = |what: String, available: String| FileError::NotFound {
            file: self.path().to_owned(),
            what,
            available,
        };
        if let Some(view) = &selection.view
            && !catalogue.views.contains(view)
        {
            let available = match catalogue.views.len() {
                0 => "one view without a name; leave the view out".to_owned(),
                _ => listed(catalogue.views.iter().cloned()),
            };
            return Err(missing(format!("view '{view}'"), available));
        }
        if let Some(part) = &selection.part
            && !(0..self.container.parts.len()).any(|index| catalogue.is_part(index, part))
        {
            let names = (0..self.container.parts.len()).map(|part| catalogue.part_name(part));
            return Err(missing(format!("part '{part}'"), listed(names)));
        }
        let in_part =
            |layer: &Layer| selection.part.as_ref().is_none_or(|part| catalogue.is_part(layer.part, part));
        let in_view = |layer: &Layer, view: &Option<String>| {
            view.is_none() || layer.view.is_none() || layer.view == *view
        };
        let deep_part = |layer: &Layer| self.container.parts[layer.part].header.deep;

        // The beauty decides the view where none was asked for.
        let beauty = catalogue.beauty(|l| {
            in_part(l) && in_view(l, &selection.view) && !deep_part(l) && !catalogue.is_chroma(l)
        });
        let mut view = selection.view.clone();
        if view.is_none() {
            view = beauty.and_then(|layer| layer.view.clone()).or_else(|| catalogue.views.first().cloned());
        }
        if selection.layers.is_empty() {
            let mut chosen = Chosen { layers: vec![], colors: vec![], alpha: None, view };
            if let Some(beauty) = beauty {
                chosen.add(beauty, self.all_of(beauty));
            } else if !selection.color_optional {
                self.check_flat(in_part)?;
                return Err(missing("colour layer to blur".to_owned(), self.all_channels()));
            }
            return Ok(chosen);
        }

        let mut chosen = Chosen { layers: vec![], colors: vec![], alpha: None, view };
        for pattern in &selection.layers {
            let wild = pattern.contains(['*', '?']);
            let fits = |layer: &&Layer| {
                in_part(layer)
                    && in_view(layer, &chosen.view)
                    && catalogue.matches(layer, pattern)
                    && (!wild || (catalogue.is_light(layer) && !deep_part(layer)))
            };
            let found: Vec<Layer> = catalogue.layers.iter().filter(fits).cloned().collect();
            let channels: Vec<_> = found.iter().map(|layer| self.all_of(layer)).collect();
            if !found.is_empty() && channels.iter().all(|(colors, _)| colors.is_empty()) {
                return Err(FileError::unsupported(
                    self.path(),
                    format!("layer '{pattern}' holds no colour to blur"),
                    "choose a layer that does, or a single channel by its full name",
                ));
            }
            for (layer, channels) in found.iter().zip(channels) {
                chosen.add(layer, channels);
            }
            if found.is_empty() {
                let named = self.named(pattern, chosen.view.as_deref(), selection.part.as_deref());
                let Some(channel) = named.first() else {
                    let layers = catalogue.layers.iter().filter(|l| in_part(l) && in_view(l, &chosen.view));
                    let names = listed(layers.map(|layer| catalogue.layer_name(layer)));
                    return Err(missing(format!("layer '{pattern}'"), names));
                };
                let id = catalogue.channels.iter().position(|c| c == *channel).unwrap_or_default();
                let layer = catalogue.layers.iter().find(|layer| layer.channels.contains(&id));
                chosen.layers.extend(layer.cloned());
                chosen.add_color(id);
            }
        }
        Ok(chosen)
    }

    /// The channels of a layer that go through the lens: red, green, blue, else luminance, else all of them.
    fn all_of(&self, layer: &Layer) -> (Vec<usize>, Option<usize>) {
        let (colors, alpha) = self.catalogue.colours(layer);
        if !colors.is_empty() {
            return (colors, alpha);
        }
        let depths = self.catalogue.depths(None, |_| true);
        let rest = layer.channels.iter().copied().filter(|&id| {
            alpha != Some(id) && !depths.iter().any(|&depth| depth == &self.catalogue.channels[id])
        });
        let rest: Vec<usize> = rest.collect();
        // A matte alone is no picture's alpha.
        if rest.is_empty() { (alpha.into_iter().collect(), None) } else { (rest, alpha) }
    }
}

pub(crate) fn deep(path: &Path) -> FileError {
    FileError::unsupported(
        path,
        "deep pictures are not supported yet",
        "flatten it first (in Nuke DeepToImage, or 'oiiotool in.exr --flatten -o out.exr'), or give another part",
    )
}

/// Names for a message, cut short where there are many.
fn listed(names: impl Iterator<Item = String>) -> String {
    const MOST: usize = 24;
    let names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(MOST);
    let mut text = names[..names.len() - more].join(", ");
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}
