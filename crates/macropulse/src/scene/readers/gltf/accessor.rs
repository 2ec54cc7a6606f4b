//! Contents of an accessor of a glTF document: places and indices, wherever their bytes lie.

use std::ops::Range;

use ::gltf::Accessor;
use ::gltf::accessor::sparse::{IndexType, Sparse};
use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::buffer::View;

use super::{Bytes, Checked, damaged};

/// More elements than this are not there without a byte.
const MOST_OF_NOTHING: usize = 1 << 16;

const BEYOND: &str = "has an accessor that reaches beyond its buffer";

/// The bytes of all buffers.
pub(super) struct Buffers<'a> {
    pub bytes: Vec<Bytes<'a>>,
    /// True if places may be whole numbers, by `KHR_mesh_quantization`.
    pub quantised: bool,
}

impl Buffers<'_> {
    /// The places that `accessor` says, in the frame of its node.
    pub(super) fn places(&self, accessor: &Accessor) -> Checked<Vec<[f64; 3]>> {
        let kind = accessor.data_type();
        let is_known = kind == DataType::F32
            || self.quantised && !matches!(kind, DataType::U32 | DataType::F32);
        if accessor.dimensions() != Dimensions::Vec3 || !is_known {
            return damaged("has positions that are not three floats");
        }
        let bytes = self.elements(accessor)?;
        let most = match kind {
            DataType::I8 => f64::from(i8::MAX),
            DataType::U8 => f64::from(u8::MAX),
            DataType::I16 => f64::from(i16::MAX),
            _ => f64::from(u16::MAX),
        };
        let whole =
            |value: f64| if accessor.normalized() { (value / most).max(-1.0) } else { value };
        Ok(match kind {
            DataType::I8 => threes::<1>(&bytes, |[byte]| whole(f64::from(byte.cast_signed()))),
            DataType::U8 => threes::<1>(&bytes, |[byte]| whole(f64::from(byte))),
            DataType::I16 => threes(&bytes, |two| whole(f64::from(i16::from_le_bytes(two)))),
            DataType::U16 => threes(&bytes, |two| whole(f64::from(u16::from_le_bytes(two)))),
            _ => threes(&bytes, |four| f64::from(f32::from_le_bytes(four))),
        })
    }

    /// The indices that `accessor` says.
    pub(super) fn indices(&self, accessor: &Accessor) -> Checked<Vec<u32>> {
        if accessor.dimensions() != Dimensions::Scalar {
            return damaged("has indices that are not unsigned integers");
        }
        let kind = match accessor.data_type() {
            DataType::U8 => IndexType::U8,
            DataType::U16 => IndexType::U16,
            DataType::U32 => IndexType::U32,
            _ => return damaged("has indices that are not unsigned integers"),
        };
        Ok(whole_numbers(&self.elements(accessor)?, &kind))
    }

    /// The bytes of all elements, one behind the other.
    fn elements(&self, accessor: &Accessor) -> Checked<Vec<u8>> {
        let (count, size) = (accessor.count(), accessor.size());
        let mut elements = match accessor.view() {
            None if accessor.sparse().is_none() => {
                return damaged("has an accessor without a buffer");
            }
            None => {
                let there: usize = self.bytes.iter().map(|bytes| bytes.len()).sum();
                if count > there.max(MOST_OF_NOTHING) {
                    return damaged("has an accessor without a buffer");
                }
                vec![0; count * size]
            }
            Some(view) => {
                let stride = view.stride().unwrap_or(size);
                if stride < size {
                    return damaged("has an accessor whose elements overlap");
                }
                let bytes = self.part(&view, accessor.offset(), (count, size, stride))?;
                match stride == size {
                    true => bytes.to_vec(),
                    false => bytes
                        .chunks(stride)
                        .flat_map(|one| one.iter().take(size))
                        .copied()
                        .collect(),
                }
            }
        };
        if let Some(sparse) = accessor.sparse() {
            self.change(&mut elements, size, &sparse)?;
        }
        Ok(elements)
    }

    /// Puts in the elements of this `size` that deviate.
    fn change(&self, elements: &mut [u8], size: usize, sparse: &Sparse) -> Checked<()> {
        let (count, indices, values) = (sparse.count(), sparse.indices(), sparse.values());
        let (kind, wide) = (indices.index_type(), indices.index_type().size());
        let which = self.part(&indices.view(), indices.offset(), (count, wide, wide))?;
        let values = self.part(&values.view(), values.offset(), (count, size, size))?;
        for (index, value) in whole_numbers(which, &kind).into_iter().zip(values.chunks(size)) {
            let from = (index as usize).saturating_mul(size);
            match elements.get_mut(from..from.saturating_add(size)) {
                Some(element) => element.copy_from_slice(value),
                None => return damaged("has a sparse accessor that changes what is not there"),
            }
        }
        Ok(())
    }

    /// The bytes of `count` elements of a `size`, each a stride behind the one before, from an offset
    /// of a view.
    fn part(
        &self,
        view: &View,
        offset: usize,
        (count, size, stride): (usize, usize, usize),
    ) -> Checked<&[u8]> {
        // The lengths are whatever the document says.
        let buffer = self.bytes.get(view.buffer().index());
        let there = buffer.map_or(0, |buffer| buffer.len());
        let range = || -> Option<Range<usize>> {
            let length = match count.checked_sub(1) {
                Some(steps) => steps.checked_mul(stride)?.checked_add(size)?,
                None => 0,
            };
            let end = offset.checked_add(length)?;
            let view_ends = view.offset().checked_add(view.length())?;
            (end <= view.length() && view_ends <= there).then_some(())?;
            Some(view.offset() + offset..view.offset() + end)
        };
        match (range(), buffer) {
            (Some(range), Some(buffer)) => buffer.get(range).map_or_else(|| damaged(BEYOND), Ok),
            _ => damaged(BEYOND),
        }
    }
}

/// Returns the numbers in `bytes`, each of `N` bytes, in threes.
fn threes<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<[f64; 3]> {
    let numbers: Vec<f64> = bytes.as_chunks().0.iter().map(|bytes| number(*bytes)).collect();
    numbers.as_chunks().0.to_vec()
}

fn whole_numbers(bytes: &[u8], kind: &IndexType) -> Vec<u32> {
    match kind {
        IndexType::U8 => bytes.iter().map(|byte| u32::from(*byte)).collect(),
        IndexType::U16 => {
            bytes.as_chunks().0.iter().map(|two| u32::from(u16::from_le_bytes(*two))).collect()
        }
        IndexType::U32 => {
            bytes.as_chunks().0.iter().map(|four| u32::from_le_bytes(*four)).collect()
        }
    }
}
