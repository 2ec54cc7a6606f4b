//! Numbers of points in another order than ours: column by column, or with the highest byte first.

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

/// Turns the numbers of each record round. Number k of a record takes `widths[k]` bytes.
pub(super) fn turn_round(records: &mut [u8], widths: &[usize]) {
    let stride: usize = widths.iter().sum();
    for record in records.chunks_exact_mut(stride.max(1)) {
        let mut rest = record;
        for width in widths {
            let (number, behind) = rest.split_at_mut((*width).min(rest.len()));
            number.reverse();
            rest = behind;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_records() {
        assert_eq!(columns(b"aabbccdd1234", &[2, 1], 4), b"aa1bb2cc3dd4");
        assert_eq!(columns(b"", &[2, 0, 1], 0), b"");
    }

    #[test]
    fn each_number_is_turned_round() {
        let mut records = *b"12341abcd5";
        turn_round(&mut records, &[4, 1]);
        assert_eq!(&records, b"43211dcba5");
    }
}
