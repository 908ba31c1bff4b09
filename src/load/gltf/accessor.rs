//! Accessors: typed, bounded views of bytes. Component type, shape and normalisation are checked for each use
//! (the `gltf` crate reinterprets whatever it finds), and sizes before anything is allocated.

use super::Result;
use super::buffer::Span;
use super::document::Document;
use super::semantic::{Kind, Wanted};
use gltf::json::Index;
use gltf::json::accessor::sparse::Sparse as SparseJson;
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, IndexComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::validation::{Checked, USize64};
use std::io::Read;

/// Elements that an accessor without a buffer view may have: zeros cost the file nothing and us up to 16 bytes each, so
/// without a bound a file of a kilobyte could ask for all memory (1 GiB at this bound).
pub(super) const MAX_ZEROS: u64 = 1 << 26;
/// Bytes read and converted at a time: fits the second-level cache.
const CHUNK: usize = 1 << 18;

/// The elements of a checked accessor, not yet read.
pub(super) struct Elements<'d> {
    /// How many.
    pub count: usize,
    doc: &'d Document,
    at: String,
    components: usize,
    kind: Kind,
    /// Where they are and how far apart, bytes; `None` = zeros.
    base: Option<(Span<'d>, usize)>,
    sparse: Option<Sparse<'d>>,
}

/// Elements that replace others.
struct Sparse<'d> {
    count: usize,
    /// Which, and of which type.
    indices: (Span<'d>, ComponentType),
    values: Span<'d>,
}

/// Opens accessor `index`, which was found at `pointer`, for the purpose `wanted`.
pub(super) fn open<'d>(
    doc: &'d Document,
    index: Index<Accessor>,
    pointer: &str,
    wanted: &Wanted,
) -> Result<Elements<'d>> {
    let accessor = doc.item(&doc.root.accessors, index, pointer, "accessors")?;
    let at = format!("/accessors/{}", index.value());
    let (kind, components) = check_type(doc, accessor, &at, wanted)?;
    let size = components * kind.component.size();
    let count = accessor.count.0;
    let base = match accessor.buffer_view {
        Some(view) => Some(base(doc, accessor, &at, view, wanted, [size, kind.component.size()])?),
        None if count > MAX_ZEROS => {
            let fix = format!("At most {MAX_ZEROS} elements may go without a bufferView, that is be zeros.");
            return Err(doc.bad(&format!("{at}/count"), "is too many", fix));
        }
        // A byteOffset without a bufferView means nothing; exporters write it.
        None => None,
    };
    let sparse = match &accessor.sparse {
        None => None,
        Some(found) => Some(sparse(doc, found, &format!("{at}/sparse"), count, [size, kind.component.size()])?),
    };
    // The count fits usize: it is at most the bytes of the view, or MAX_ZEROS.
    Ok(Elements { count: count as usize, doc, at, components, kind, base, sparse })
}

/// Component type and number of components, if they and the normalisation are what is wanted.
fn check_type(doc: &Document, accessor: &Accessor, at: &str, wanted: &Wanted) -> Result<(Kind, usize)> {
    let name = &wanted.name;
    let fix = format!("{name} must be {}.", wanted.allowed);
    let shape = match accessor.type_ {
        Checked::Valid(shape) if wanted.shapes.contains(&shape) => shape,
        _ => return Err(doc.bad(&format!("{at}/type"), &format!("as {name}"), fix)),
    };
    let component_at = format!("{at}/componentType");
    let Checked::Valid(GenericComponentType(component)) = accessor.component_type else {
        return Err(doc.bad(&component_at, "is not a component type", fix));
    };
    let kind = Kind { component, normalized: accessor.normalized };
    if wanted.core.contains(&kind) {
        return Ok((kind, shape.multiplicity()));
    }
    let quantized = if doc.uses("KHR_mesh_quantization") { wanted.quantized } else { &[] };
    if quantized.contains(&kind) {
        return Ok((kind, shape.multiplicity()));
    }
    let hint = match wanted.quantized.contains(&kind) {
        true => " This type needs KHR_mesh_quantization, which extensionsUsed does not list.",
        false => "",
    };
    if wanted.core.iter().chain(quantized).any(|k| k.component == component) {
        let problem = format!("{} as {name}", accessor.normalized);
        return Err(doc.error(format!("{at}/normalized"), problem, fix + hint));
    }
    Err(doc.bad(&component_at, &format!("as {name}"), fix + hint))
}

/// Where the elements of an accessor with a buffer view are, and how far apart; `size` is that of an element and of a
/// component, bytes.
fn base<'d>(
    doc: &'d Document,
    accessor: &Accessor,
    at: &str,
    view_index: Index<View>,
    wanted: &Wanted,
    [size, component]: [usize; 2],
) -> Result<(Span<'d>, usize)> {
    let (span, view) = doc.span(view_index, &format!("{at}/bufferView"))?;
    let stride = match view.byte_stride {
        None => size,
        Some(stride) => {
            let scalar = wanted.shapes == [Type::Scalar];
            let fixed = scalar && stride.0 != size;
            if stride.0 < size || !stride.0.is_multiple_of(component) || fixed {
                let why = format!("does not fit {}, whose elements have {size} bytes", wanted.name);
                let fix = match scalar {
                    true => "Views of indices have no byteStride.".to_owned(),
                    false => format!("Allowed are multiples of {component} from {size} on."),
                };
                return Err(doc.bad(&format!("/bufferViews/{}/byteStride", view_index.value()), &why, fix));
            }
            stride.0
        }
    };
    let offset = accessor.byte_offset.unwrap_or(USize64(0)).0;
    check_alignment(doc, at, offset, view, component)?;
    let count = accessor.count.0;
    let needed = count
        .checked_sub(1)
        .map_or(Some(0), |last| last.checked_mul(stride as u64)?.checked_add(size as u64)?.checked_add(offset));
    let part = needed.and_then(|needed| span.part(offset.min(needed), needed - offset.min(needed)));
    part.map(|part| (part, stride)).ok_or_else(|| {
        let view = view_index.value();
        let problem =
            format!("count {count} x {stride} bytes from byteOffset {offset} is past the end of bufferView {view}");
        doc.error(at, problem, format!("The view has {} bytes.", span.length))
    })
}

/// Offsets must be multiples of the component's size.
fn check_alignment(doc: &Document, at: &str, offset: u64, view: &View, component: usize) -> Result<()> {
    let view_offset = view.byte_offset.unwrap_or(USize64(0)).0;
    // A view lies in a buffer of less than 2^63 bytes, so only `offset` can be absurd, and then the range is refused.
    if offset.wrapping_add(view_offset).is_multiple_of(component as u64) {
        return Ok(());
    }
    let problem = format!("byteOffset {offset} + byteOffset {view_offset} of the view is misaligned");
    Err(doc.error(at, problem, format!("It must be a multiple of the component size, {component}.")))
}

/// The sparse part of an accessor of `count` elements.
fn sparse<'d>(
    doc: &'d Document,
    found: &SparseJson,
    at: &str,
    count: u64,
    [size, component]: [usize; 2],
) -> Result<Sparse<'d>> {
    let replaced = found.count.0;
    if replaced > count {
        let fix = format!("The accessor has {count} elements: no more can be replaced.");
        return Err(doc.bad(&format!("{at}/count"), "is too many", fix));
    }
    let types = "Allowed: unsigned byte (5121), short (5123) or int (5125).";
    let Checked::Valid(IndexComponentType(index_type)) = found.indices.component_type else {
        return Err(doc.bad(&format!("{at}/indices/componentType"), "is not a type of indices", types));
    };
    let part = |name: &str, view_index, offset: u64, element: usize, component: usize| {
        let at = format!("{at}/{name}");
        let (span, view) = doc.span(view_index, &format!("{at}/bufferView"))?;
        if view.byte_stride.is_some() {
            let stride_at = format!("/bufferViews/{}/byteStride", view_index.value());
            return Err(doc.bad(&stride_at, "in a view of sparse data", "They are packed: no byteStride is allowed."));
        }
        check_alignment(doc, &at, offset, view, component)?;
        let part = replaced.checked_mul(element as u64).and_then(|length| span.part(offset, length));
        part.ok_or_else(|| {
            let problem = format!(
                "count {replaced} x {element} bytes from byteOffset {offset} is past the end of bufferView {}",
                view_index.value()
            );
            doc.error(at, problem, format!("The view has {} bytes.", span.length))
        })
    };
    let (i, v) = (&found.indices, &found.values);
    let indices = part("indices", i.buffer_view, i.byte_offset.0, index_type.size(), index_type.size())?;
    let values = part("values", v.buffer_view, v.byte_offset.0, size, component)?;
    Ok(Sparse { count: replaced as usize, indices: (indices, index_type), values })
}

impl Elements<'_> {
    /// Nothing but zeros.
    pub fn is_zero(&self) -> bool {
        self.base.is_none() && self.sparse.as_ref().is_none_or(|s| s.count == 0)
    }

    /// `[count][N]` floats; normalised integers become [0, 1] or [-1, 1], others stay what they are.
    pub fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>> {
        let kind = self.kind;
        let is_float = kind.component == ComponentType::F32;
        self.read(
            [0.0; N],
            |e| kind.floats(e),
            |packed, out| {
                if is_float {
                    let (words, _) = packed.as_chunks::<4>();
                    out.extend(words.as_chunks::<N>().0.iter().map(|e| e.map(f32::from_le_bytes)));
                }
                is_float
            },
        )
    }

    /// All numbers one after the other, `[count x components]`; normalised integers as by [`Elements::floats`].
    pub fn numbers(&self) -> Result<Vec<f32>> {
        Ok(match self.components {
            1 => self.floats::<1>()?.into_flattened(),
            2 => self.floats::<2>()?.into_flattened(),
            3 => self.floats::<3>()?.into_flattened(),
            _ => self.floats::<4>()?.into_flattened(),
        })
    }

    /// `[count]` colours; those without alpha get 1.
    pub fn colors(&self) -> Result<Vec<[f32; 4]>> {
        if self.components == 4 {
            return self.floats();
        }
        Ok(self.floats::<3>()?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
    }

    /// `[count]` unsigned integers.
    pub fn indices(&self) -> Result<Vec<u32>> {
        let component = self.kind.component;
        self.read(
            0,
            |e| unsigned(component, e),
            |packed, out| {
                match component {
                    ComponentType::U8 => out.extend(packed.iter().map(|&b| u32::from(b))),
                    ComponentType::U16 => {
                        out.extend(packed.as_chunks::<2>().0.iter().map(|b| u32::from(u16::from_le_bytes(*b))));
                    }
                    _ => out.extend(packed.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b))),
                }
                true
            },
        )
    }

    /// The greatest value that the type of indices can hold: where strips would start anew.
    pub fn restart(&self) -> u32 {
        match self.kind.component {
            ComponentType::U8 => u32::from(u8::MAX),
            ComponentType::U16 => u32::from(u16::MAX),
            _ => u32::MAX,
        }
    }

    /// All elements: `one` converts the bytes of one; `packed` converts many that lie close together, or says that it
    /// does not.
    fn read<T: Copy>(
        &self,
        zero: T,
        one: impl Fn(&[u8]) -> T,
        packed: impl Fn(&[u8], &mut Vec<T>) -> bool,
    ) -> Result<Vec<T>> {
        let unreadable = |why: std::io::Error| self.doc.unreadable(&self.at, &why);
        let size = self.components * self.kind.component.size();
        let mut out = match self.base {
            None => vec![zero; self.count],
            Some((span, stride)) => {
                let mut out = Vec::with_capacity(self.count);
                let convert = |bytes: &[u8]| {
                    if stride != size || !packed(bytes, &mut out) {
                        out.extend(bytes.chunks(stride).map(&one));
                    }
                };
                stream(span, stride, convert).map_err(unreadable)?;
                // A reader that ends early is an error, so this changes nothing; it keeps the promise of `count`.
                out.resize(self.count, zero);
                out
            }
        };
        if let Some(sparse) = &self.sparse {
            let places = sparse.indices.0.bytes().map_err(unreadable)?;
            let values = sparse.values.bytes().map_err(unreadable)?;
            let type_ = sparse.indices.1;
            let mut least = 0;
            for (k, (place, value)) in places.chunks(type_.size()).zip(values.chunks(size)).enumerate() {
                let i = unsigned(type_, place) as usize;
                let problem = |why: String| {
                    let fix = format!("They must increase and be less than the accessor's count, {}.", self.count);
                    self.doc.error(format!("{}/sparse/indices", self.at), format!("index {k} is {i}: {why}"), fix)
                };
                if i < least {
                    return Err(problem("not more than the one before".into()));
                }
                *out.get_mut(i).ok_or_else(|| problem("there is no such element".into()))? = one(value);
                least = i + 1;
            }
        }
        Ok(out)
    }
}

/// Reads a span piece by piece, whole strides at a time, so that a large accessor does not exist twice.
fn stream(span: Span, stride: usize, mut take: impl FnMut(&[u8])) -> std::io::Result<()> {
    let mut reader = span.reader()?;
    let mut left = span.length;
    let most = stride * (CHUNK / stride).max(1);
    let mut buffer = vec![0; usize::try_from(left).unwrap_or(most).min(most)];
    while left > 0 {
        let n = usize::try_from(left).unwrap_or(most).min(most);
        let piece = buffer.get_mut(..n).unwrap_or_default();
        reader.read_exact(piece)?;
        take(piece);
        left -= n as u64;
    }
    Ok(())
}

/// An unsigned integer of up to 32 bits. (Reads past the end cannot happen after `open`; they would give 0.)
fn unsigned(component: ComponentType, bytes: &[u8]) -> u32 {
    let mut word = [0; 4];
    word.iter_mut().zip(bytes.iter().take(component.size())).for_each(|(w, b)| *w = *b);
    u32::from_le_bytes(word)
}
