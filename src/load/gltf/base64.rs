//! Base64 of data URIs (RFC 4648, section 4), strictly: standard alphabet, padded, no white space.

/// Six bits of a character, or `None`.
fn sextet(c: u8) -> Option<u8> {
    match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    }
}

/// The decoded bytes; the error says what is wrong and where.
pub(super) fn decode(text: &[u8]) -> Result<Vec<u8>, String> {
    if !text.len().is_multiple_of(4) {
        return Err(format!("base64 text of {} characters, not a multiple of 4", text.len()));
    }
    let padding = text.iter().rev().take(2).take_while(|&&c| c == b'=').count();
    let body = text.len() - padding;
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    for (n, group) in text.chunks_exact(4).enumerate() {
        let mut bits = 0_u32;
        for (i, &c) in group.iter().enumerate() {
            let at = 4 * n + i;
            let six = if at >= body { Some(0) } else { sextet(c) };
            let Some(six) = six else {
                return Err(format!("character {:?} at {at} is not base64", char::from(c)));
            };
            bits = bits << 6 | u32::from(six);
        }
        let [_, a, b, c] = bits.to_be_bytes();
        out.extend([a, b, c]);
    }
    out.truncate(out.len() - padding);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::decode;

    #[test]
    fn test_vectors_of_rfc_4648_decode() {
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(decode(text.as_bytes()).unwrap(), bytes.as_bytes());
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["Zg=", "Zg", "Z===", "Zm9v=A==", "Zm 9", "Zm9-", "====", "Zg==Zg=="] {
            assert!(decode(text.as_bytes()).is_err(), "{text}");
        }
    }
}
