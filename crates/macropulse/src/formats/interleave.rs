//! Numbers of points that are stored column by column.

/// The bytes of `points` records, of columns that follow each other. The numbers of column k take
/// `widths[k]` bytes in a record. `columns` must hold them all.
pub(super) fn columns(columns: &[u8], widths: &[usize], points: usize) -> Vec<u8> {
    let stride: usize = widths.iter().sum();
    let mut records = vec![0; columns.len()];
    let (mut column, mut offset) = (columns, 0);
    for width in widths.iter().copied().filter(|width| *width > 0) {
        let (these, rest) = column.split_at_checked(width * points).unwrap_or_default();
        for (record, bytes) in records.chunks_exact_mut(stride).zip(these.chunks_exact(width)) {
            record[offset..offset + width].copy_from_slice(bytes);
        }
        (column, offset) = (rest, offset + width);
    }
    records
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_records() {
        assert_eq!(columns(b"aabbccdd1234", &[2, 1], 4), b"aa1bb2cc3dd4");
        assert_eq!(columns(b"", &[2, 0, 1], 0), b"");
    }
}
