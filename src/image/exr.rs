//! Writes OpenEXR: linear R, G, B, A, float or half, with metadata; equal pictures have equal bytes.

use super::exr_header::sort_attributes;
use exr::image::write::channels::WritableChannels;
use exr::meta::attribute::Chromaticities;
use exr::prelude::*;
use glam::{DMat4, DVec3, DVec4};
use std::io::Cursor;

/// Lossless compressions of the pixel data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Deflate over 16 lines.
    #[default]
    Zip,
    /// Deflate over single lines.
    Zips,
    /// Wavelets.
    Piz,
    /// Run lengths.
    Rle,
    /// As it is.
    None,
}

/// How a sample is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrSamples {
    /// 32 bits: as rendered.
    #[default]
    Float,
    /// 16 bits: 11 bits of precision; beyond 65504 clipped, see [`clipped_by_half`].
    Half,
}

/// How an EXR is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrOptions {
    /// Of every channel.
    pub samples: ExrSamples,
    /// Of the pixel data; lossless.
    pub compression: ExrCompression,
}

/// What an EXR file says.
#[derive(Clone, Debug)]
pub struct ExrPicture<'a> {
    /// Width and height of the display window, pixels, origin (0, 0).
    pub display_size: [u32; 2],
    /// Left and top edge of the data window, pixels.
    pub origin: [u32; 2],
    /// Width and height of the data window, pixels.
    pub size: [u32; 2],
    /// `[height * width]` of the data window: linear Rec.709; alpha is written as 1.
    pub pixels: &'a [[f32; 3]],
    /// Channels beside R, G, B, A.
    pub channels: Vec<ExrChannel>,
    /// For `worldToCamera` and `worldToNDC`.
    pub camera: ExrCamera,
    /// For `aperture` and `focus`; `None`: a pinhole, or nobody knows.
    pub lens: Option<ExrLens>,
    /// The other attributes; names of at most 31 bytes, each once.
    pub attributes: Vec<(&'static str, ExrValue)>,
}

/// A channel beside the colour, of the same pixels.
#[derive(Clone, Debug)]
pub struct ExrChannel {
    /// With its layer in front: `variance.R`.
    pub name: &'static str,
    /// `[height * width]` of the data window.
    pub samples: ExrChannelSamples,
}

/// As they are stored, whatever the colour is stored as.
#[derive(Clone, Debug)]
pub enum ExrChannelSamples {
    /// 32 bits.
    Float(Vec<f32>),
    /// 32 bits.
    Uint(Vec<u32>),
}

/// The camera of a picture.
#[derive(Clone, Copy, Debug)]
pub struct ExrCamera {
    /// Rigid, right-handed, looking along -Z, for column vectors; metres.
    pub world_from_camera: DMat4,
    /// How points become pixels.
    pub projection: ExrProjection,
    /// Width over height of the display window.
    pub aspect_ratio: f64,
}

/// How points become pixels.
#[derive(Clone, Copy, Debug)]
pub enum ExrProjection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians.
        yfov: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the height of what is seen, metres.
        half_height: f64,
    },
}

/// OpenEXR's own attributes of a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExrLens {
    /// `aperture`: the f-number.
    pub f_stop: f32,
    /// Metres to what is sharp; may be infinite.
    pub focus: f32,
}

/// Value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum ExrValue {
    /// `string`, stored as UTF-8.
    Text(String),
    /// `int`.
    Int(i32),
    /// `double`.
    Double(f64),
}

/// Pixels up to which one thread compresses: exr starts a pool of threads for every picture, which took longer than a
/// picture of this size.
const SMALL: usize = 1 << 15;

/// The bytes of an EXR of `picture`.
///
/// # Errors
/// The pixels do not fill the data window, or the picture does not fit the format, as text.
pub fn encode(picture: &ExrPicture<'_>, options: ExrOptions) -> std::result::Result<Vec<u8>, String> {
    let size = picture.size.map(|side| side as usize);
    if picture.pixels.len() != size[0] * size[1] {
        return Err(format!("EXR: {} pixels do not fill {} x {}", picture.pixels.len(), size[0], size[1]));
    }
    let lengths = picture.channels.iter().map(|channel| match &channel.samples {
        ExrChannelSamples::Float(samples) => samples.len(),
        ExrChannelSamples::Uint(samples) => samples.len(),
    });
    if let Some((channel, n)) = picture.channels.iter().zip(lengths).find(|(_, n)| *n != picture.pixels.len()) {
        return Err(format!("EXR: {n} samples of {} do not fill {} x {}", channel.name, size[0], size[1]));
    }
    let is_small = picture.pixels.len() <= SMALL;
    let pixel = |at: Vec2<usize>| picture.pixels[at.y() * size[0] + at.x()];
    let mut bytes = Cursor::new(Vec::new());
    match options.samples {
        _ if !picture.channels.is_empty() => {
            let image = image(picture, options.compression, with_channels(picture, options.samples));
            match is_small {
                true => image.write().non_parallel().to_buffered(&mut bytes),
                false => image.write().to_buffered(&mut bytes),
            }
        }
        ExrSamples::Float => {
            let float = |at| {
                let [r, g, b] = pixel(at);
                (r, g, b, 1.0_f32)
            };
            let image = image(picture, options.compression, SpecificChannels::rgba(float));
            match is_small {
                true => image.write().non_parallel().to_buffered(&mut bytes),
                false => image.write().to_buffered(&mut bytes),
            }
        }
        ExrSamples::Half => {
            let half = |at| {
                let [r, g, b] = pixel(at).map(half);
                (r, g, b, f16::ONE)
            };
            let image = image(picture, options.compression, SpecificChannels::rgba(half));
            match is_small {
                true => image.write().non_parallel().to_buffered(&mut bytes),
                false => image.write().to_buffered(&mut bytes),
            }
        }
    }
    .map_err(|error| format!("EXR: {error}"))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or("EXR: the header just written cannot be read")?;
    Ok(bytes)
}

/// R, G, B, A and the other channels.
fn with_channels(picture: &ExrPicture<'_>, samples: ExrSamples) -> AnyChannels<FlatSamples> {
    let colour = |name: &'static str, value: &dyn Fn(&[f32; 3]) -> f32| {
        let values = picture.pixels.iter().map(value);
        let samples = match samples {
            ExrSamples::Float => FlatSamples::F32(values.collect()),
            ExrSamples::Half => FlatSamples::F16(values.map(half).collect()),
        };
        AnyChannel::new(name, samples)
    };
    let other = |channel: &ExrChannel| {
        let samples = match &channel.samples {
            ExrChannelSamples::Float(samples) => FlatSamples::F32(samples.clone()),
            ExrChannelSamples::Uint(samples) => FlatSamples::U32(samples.clone()),
        };
        AnyChannel::new(channel.name, samples)
    };
    let colours = [colour("R", &|p| p[0]), colour("G", &|p| p[1]), colour("B", &|p| p[2]), colour("A", &|_| 1.0)];
    AnyChannels::sort(colours.into_iter().chain(picture.channels.iter().map(other)).collect())
}

/// The nearest half; beyond the greatest, that one instead of infinity. NaN stays NaN.
fn half(value: f32) -> f16 {
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

/// How many of `pixels` have a channel that half clips: beyond 65504 either way, infinity included.
pub fn clipped_by_half(pixels: &[[f32; 3]]) -> u64 {
    let is_clipped = |pixel: &&[f32; 3]| pixel.iter().any(|c| c.abs() > f16::MAX.to_f32());
    pixels.iter().filter(is_clipped).count() as u64
}

/// An EXR of `channels` with what else `picture` says.
fn image<'c, C: WritableChannels<'c> + 'c>(
    picture: &ExrPicture<'_>,
    compression: ExrCompression,
    channels: C,
) -> Image<Layer<C>> {
    let encoding = Encoding {
        compression: match compression {
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Piz => Compression::PIZ,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::None => Compression::Uncompressed,
        },
        blocks: Blocks::ScanLines,
        // Any other order would let the threads that compress decide the order of the chunks.
        line_order: LineOrder::Increasing,
    };
    let size = picture.size.map(|side| side as usize);
    let mut layer = Layer::new((size[0], size[1]), LayerAttributes::default(), encoding, channels);
    layer.attributes.layer_position = Vec2(picture.origin[0] as i32, picture.origin[1] as i32);
    let matrices = CameraMatrices::new(&picture.camera);
    layer.attributes.world_to_camera = Some(stored_for_row_vectors(matrices.camera_from_world));
    layer.attributes.world_to_normalized_device = Some(stored_for_row_vectors(matrices.ndc_from_world));
    for (name, value) in &picture.attributes {
        let value = match value {
            ExrValue::Text(value) => AttributeValue::Text(text(value)),
            ExrValue::Int(value) => AttributeValue::I32(*value),
            ExrValue::Double(value) => AttributeValue::F64(*value),
        };
        layer.attributes.other.insert(text(name), value);
    }
    if let Some(ExrLens { f_stop, focus }) = picture.lens {
        (layer.attributes.aperture, layer.attributes.focus) = (Some(f_stop), Some(focus));
    }
    let mut image = Image::from_layer(layer);
    image.attributes.display_window =
        IntegerBounds::new(Vec2(0, 0), Vec2(picture.display_size[0] as usize, picture.display_size[1] as usize));
    image.attributes.chromaticities = Some(REC_709);

    image
}

/// Primaries and white point of ITU-R BT.709.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Text as UTF-8: the crate's own conversion panics outside Latin-1 and writes Latin-1 bytes, which other readers refuse.
fn text(value: &str) -> Text {
    Text::from_bytes_unchecked(value.bytes().collect())
}

/// World to camera and to the picture, for column vectors.
struct CameraMatrices {
    /// Left-handed: +x right, +y up, +z forward, metres.
    camera_from_world: DMat4,
    /// After division by w: (0,0) upper left, (1,1) lower right of the display window; z in [0, 1), 0 at [`NDC_NEAR`].
    ndc_from_world: DMat4,
}

/// Distance that has depth 0 in `worldToNDC`, metres; nothing is clipped by it.
const NDC_NEAR: f64 = 0.01;

impl CameraMatrices {
    fn new(camera: &ExrCamera) -> Self {
        let camera_from_world = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)) * camera.world_from_camera.inverse();
        let half_height = match camera.projection {
            ExrProjection::Perspective { yfov } => (yfov * 0.5).tan(),
            ExrProjection::Orthographic { half_height } => half_height,
        };
        if matches!(camera.projection, ExrProjection::Orthographic { .. }) {
            // x_ndc = 1/2 + x / (2 half_width), y_ndc = 1/2 - y / (2 half_height), w = 1, depth = z - near in metres.
            let ndc_from_camera = DMat4::from_cols(
                DVec4::new(0.5 / (half_height * camera.aspect_ratio), 0.0, 0.0, 0.0),
                DVec4::new(0.0, -0.5 / half_height, 0.0, 0.0),
                DVec4::new(0.0, 0.0, 1.0, 0.0),
                DVec4::new(0.5, 0.5, -NDC_NEAR, 1.0),
            );
            return Self { camera_from_world, ndc_from_world: ndc_from_camera * camera_from_world };
        }
        // x_ndc = 1/2 + x / (2 z half_width), y_ndc = 1/2 - y / (2 z half_height), with w = z.
        let ndc_from_camera = DMat4::from_cols(
            DVec4::new(0.5 / (half_height * camera.aspect_ratio), 0.0, 0.0, 0.0),
            DVec4::new(0.0, -0.5 / half_height, 0.0, 0.0),
            DVec4::new(0.5, 0.5, 1.0, 1.0),
            DVec4::new(0.0, 0.0, -NDC_NEAR, 0.0),
        );
        Self { camera_from_world, ndc_from_world: ndc_from_camera * camera_from_world }
    }
}

/// `[4][4]`, row by row, of the matrix for row vectors: the transpose row by row is the original column by column.
fn stored_for_row_vectors(matrix: DMat4) -> [f32; 16] {
    matrix.to_cols_array().map(|x| x as f32)
}

#[cfg(test)]
#[path = "exr_tests.rs"]
mod tests;
