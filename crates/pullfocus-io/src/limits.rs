//! What a file may ask for before it is refused.

/// Upper bounds on what one file may make the program allocate or do. They are checked against what the
/// file's header says, before memory is taken. Raise them for files that are meant to be that large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Pixels of one picture, part or level: width times height.
    pub max_pixels: u64,
    /// Bytes of all f32 planes that are taken from one file at once.
    pub max_plane_bytes: u64,
    /// Bytes of a header with all its attributes (previews and cryptomatte manifests are the large ones).
    pub max_header_bytes: u64,
    /// Channels of all parts together.
    pub max_channels: usize,
    /// Parts of one file.
    pub max_parts: usize,
    /// Scan-line blocks and tiles of all parts together, all levels counted.
    pub max_chunks: u64,
    /// Bytes of one decoded scan-line block or tile; a few of them are in memory at a time.
    pub max_chunk_bytes: u64,
}

impl Default for Limits {
    /// 2^29 pixels (16384 x 32768), 16 GiB of planes, 64 MiB of header, 4096 channels, 1024 parts,
    /// 2^22 chunks, 1 GiB a chunk.
    fn default() -> Self {
        Self {
            max_pixels: 1 << 29,
            max_plane_bytes: 16 << 30,
            max_header_bytes: 64 << 20,
            max_channels: 4096,
            max_parts: 1024,
            max_chunks: 1 << 22,
            max_chunk_bytes: 1 << 30,
        }
    }
}
