//! Puts the attributes of a finished EXR header into alphabetical order.
//!
//! The exr crate keeps custom attributes in a hash map, so that their order, and with it the bytes of the file, would
//! differ from process to process. Sorting keeps the header's size, hence every offset in the file stays right.

/// Bytes of magic number and version.
const PREAMBLE: usize = 8;

/// Sorts the attributes of the only header of `file` (single part) by name, in place; `None` if it is no such header.
pub(super) fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = PREAMBLE;
    while *file.get(at)? != 0 {
        let end = attribute_end(file, at)?;
        attributes.push(&file[at..end]);
        at = end;
    }
    // The name comes first and ends with a zero byte, which sorts before any letter.
    attributes.sort_unstable();
    let sorted = attributes.concat();
    file[PREAMBLE..at].copy_from_slice(&sorted);
    Some(())
}

/// End of the attribute that starts at `at`: name, 0, type, 0, `i32` size, value.
fn attribute_end(file: &[u8], at: usize) -> Option<usize> {
    let name_end = at + file.get(at..)?.iter().position(|&b| b == 0)?;
    let type_end = name_end + 1 + file.get(name_end + 1..)?.iter().position(|&b| b == 0)?;
    let size = file.get(type_end + 1..type_end + 5)?;
    let size = u32::from_le_bytes(size.try_into().expect("four bytes were sliced")) as usize;
    let end = type_end.checked_add(5)?.checked_add(size)?;
    (end <= file.len()).then_some(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(name: &str, value: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend_from_slice(b"\0string\0");
        bytes.extend_from_slice(&(value.len() as u32).to_le_bytes());
        bytes.extend_from_slice(value);
        bytes
    }

    #[test]
    fn attributes_are_sorted_and_the_rest_is_kept() {
        let (a, ab, b) = (attribute("a", b"zzzz"), attribute("ab", b"1\x002"), attribute("b", b""));
        let preamble = [1, 2, 3, 4, 5, 6, 7, 8].as_slice();
        let mut file = [preamble, &b, &ab, &a, b"\0pixels"].concat();
        sort_attributes(&mut file).unwrap();
        assert_eq!(file, [preamble, &a, &ab, &b, b"\0pixels"].concat());
    }

    #[test]
    fn a_cut_header_is_refused() {
        let file = [[0_u8; 8].as_slice(), &attribute("a", b"zzzz")].concat();
        for length in 0..=file.len() {
            assert_eq!(sort_attributes(&mut file[..length].to_vec()), None);
        }
    }
}
