//! Text in a file, which may be any bytes.

/// Text of a file for people: UTF-8 where it is that, else Latin-1, and nothing that moves a terminal's cursor.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let text = std::str::from_utf8(bytes).map_or_else(|_| latin1(bytes), str::to_owned);
    printable(&text)
}

/// The text with control characters replaced.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Text of a file, one char a byte: every byte survives.
pub(crate) fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// The texts of a `stringvector`; stops where its sizes do not fit.
pub(crate) fn texts(bytes: &[u8]) -> Vec<String> {
    let mut rest = bytes;
    let mut texts = Vec::new();
    while let Some((size, after)) = rest.split_first_chunk::<4>() {
        let Ok(size) = usize::try_from(i32::from_le_bytes(*size)) else { break };
        let Some(text) = after.get(..size) else { break };
        texts.push(shown(text));
        rest = &after[size..];
    }
    texts
}
