//! Reads the colour of EXR files of any renderer, for comparison and for other tone curves.

use exr::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// Linear RGB of an EXR's data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Left and top edge of the data window in the display window, pixels.
    pub origin: [i32; 2],
    /// Pixels across the data window.
    pub width: usize,
    /// Pixels down the data window.
    pub height: usize,
    /// `[height * width]`, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// The part of this picture that `window` covers, `None` if `window` is not wholly inside.
    pub fn part(&self, window: &Self) -> Option<Self> {
        let x = usize::try_from(i64::from(window.origin[0]) - i64::from(self.origin[0])).ok()?;
        let y = usize::try_from(i64::from(window.origin[1]) - i64::from(self.origin[1])).ok()?;
        if x + window.width > self.width || y + window.height > self.height {
            return None;
        }
        let rows = (y..y + window.height).map(|row| &self.pixels[row * self.width + x..][..window.width]);
        Some(Self {
            origin: window.origin,
            width: window.width,
            height: window.height,
            pixels: rows.flatten().copied().collect(),
        })
    }
}

/// Reads the file at `path`.
///
/// # Errors
/// What is wrong, without the path.
pub fn read(path: &Path) -> std::result::Result<Picture, String> {
    decode(&std::fs::read(path).map_err(|error| error.to_string())?)
}

/// Reads R, G, B (or Y as grey) of half, float or uint channels: those without a layer name, else those of the first
/// layer that has them (`Combined.R`, `ViewLayer.Combined.R`).
///
/// # Errors
/// It is no EXR, it is damaged, or it has no colour channels.
pub fn decode(bytes: &[u8]) -> std::result::Result<Picture, String> {
    decode_with_alpha(bytes).map(|(picture, _)| picture)
}

/// Every channel of an EXR's first part by its name, in the order of names: `[height * width]`, whatever they are stored
/// as.
///
/// # Errors
/// It is no EXR, or it is damaged.
pub fn channels(bytes: &[u8]) -> std::result::Result<Vec<(String, Vec<f32>)>, String> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| format!("not a readable EXR: {error}"))?;
    let channel = |channel: AnyChannel<FlatSamples>| {
        let count = channel.sample_data.len();
        let values = (0..count).map(|i| channel.sample_data.value_by_flat_index(i).to_f32()).collect();
        (channel.name.to_string(), values)
    };
    Ok(image.layer_data.channel_data.list.into_iter().map(channel).collect())
}

/// [`decode`], and the samples of `A` of the same layer if it has one: `[height * width]`, 1 = opaque, the colour being
/// premultiplied by it.
///
/// # Errors
/// As [`decode`].
pub fn decode_with_alpha(bytes: &[u8]) -> std::result::Result<(Picture, Option<Vec<f32>>), String> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| format!("not a readable EXR: {error}"))?;
    let rgb = |layer: &Layer<AnyChannels<FlatSamples>>, prefix: &str| -> Option<(Picture, Option<Vec<f32>>)> {
        let find = |name: &str| {
            let full = format!("{prefix}{name}");
            layer.channel_data.list.iter().find(|c| c.name.bytes() == full.as_bytes()).map(|c| &c.sample_data)
        };
        let channels = match (find("R"), find("G"), find("B"), find("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (None, None, None, Some(y)) => [y; 3],
            _ => return None,
        };
        let count = layer.size.area();
        if channels.iter().any(|c| c.len() != count) {
            return None;
        }
        let pixels = (0..count).map(|i| channels.map(|c| c.value_by_flat_index(i).to_f32())).collect();
        let Vec2(x, y) = layer.attributes.layer_position;
        let alpha = find("A").filter(|a| a.len() == count);
        let alpha = alpha.map(|a| (0..count).map(|i| a.value_by_flat_index(i).to_f32()).collect());
        Some((Picture { origin: [x, y], width: layer.size.width(), height: layer.size.height(), pixels }, alpha))
    };
    let named = |layer: &Layer<AnyChannels<FlatSamples>>| {
        layer.channel_data.list.iter().find_map(|c| {
            let name = c.name.to_string();
            rgb(layer, &name[..=name.rfind('.')?])
        })
    };
    let layers = &image.layer_data;
    (layers.iter().find_map(|layer| rgb(layer, "")))
        .or_else(|| layers.iter().find_map(named))
        .ok_or_else(|| "no colour: it has neither channels R, G, B nor Y".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(names: [&'static str; 3]) -> Vec<u8> {
        let channel = |name: &'static str, samples| AnyChannel::new(name, samples);
        let channels = AnyChannels::sort(
            [
                channel(names[0], FlatSamples::F16(vec![f16::from_f32(0.5); 6])),
                channel(names[1], FlatSamples::F32((0..6).map(|i| i as f32).collect())),
                channel(names[2], FlatSamples::U32(vec![3; 6])),
            ]
            .into_iter()
            .collect(),
        );
        let layer = Layer::new((3, 2), LayerAttributes::default(), Encoding::SMALL_FAST_LOSSLESS, channels);
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn mixed_sample_types_and_layer_names_are_read() {
        for names in [["R", "G", "B"], ["Combined.R", "Combined.G", "Combined.B"]] {
            let picture = decode(&written(names)).unwrap();
            assert_eq!((picture.width, picture.height), (3, 2));
            assert_eq!(picture.pixels[4], [0.5, 4.0, 3.0]);
        }
    }

    #[test]
    fn alpha_is_that_of_the_layer_whose_colour_is_read() {
        let four = |prefix: &str| {
            let names = ["R", "G", "B", "A"].map(|name| format!("{prefix}{name}"));
            (0..)
                .zip(names)
                .map(|(i, name)| AnyChannel::new(name.as_str(), FlatSamples::F32(vec![i as f32; 2])))
                .collect::<Vec<_>>()
        };
        let layer = |channels: Vec<_>| {
            let channels = AnyChannels::sort(channels.into_iter().collect());
            let layer = Layer::new((2, 1), LayerAttributes::default(), Encoding::SMALL_FAST_LOSSLESS, channels);
            let mut bytes = Cursor::new(Vec::new());
            Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            decode_with_alpha(&bytes.into_inner()).unwrap()
        };
        for prefix in ["", "Combined."] {
            let (picture, alpha) = layer(four(prefix));
            assert_eq!((picture.pixels[1], alpha.unwrap()), ([0.0, 1.0, 2.0], vec![3.0; 2]));
        }
        assert!(decode_with_alpha(&written(["R", "G", "B"])).unwrap().1.is_none());
    }

    #[test]
    fn other_files_are_refused() {
        assert!(decode(b"PNG").is_err());
        assert!(decode(&written(["X", "U", "V"])).unwrap_err().contains("no colour"));
        let cut = written(["R", "G", "B"]);
        assert!(decode(&cut[..cut.len() - 9]).is_err());
    }

    #[test]
    fn part_takes_the_window_of_another_picture() {
        let pixels = (0..12).map(|i| [i as f32; 3]).collect();
        let whole = Picture { origin: [0, 0], width: 4, height: 3, pixels };
        let window = Picture { origin: [2, 1], width: 2, height: 1, pixels: vec![] };
        assert_eq!(whole.part(&window).unwrap().pixels, [[6.0; 3], [7.0; 3]]);
        assert!(whole.part(&Picture { origin: [3, 1], ..window }).is_none());
    }
}
