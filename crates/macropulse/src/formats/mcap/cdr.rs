//! CDR, the encoding of ROS 2 messages, little endian: numbers are aligned to their size, counted
//! from behind the four bytes of the header.

/// Header: plain CDR, little endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message that is being written.
pub(super) struct Encoder(Vec<u8>);

impl Encoder {
    pub fn new() -> Self {
        Self(HEADER.to_vec())
    }

    fn align(&mut self, size: usize) {
        let length = (self.0.len() - HEADER.len()).next_multiple_of(size) + HEADER.len();
        self.0.resize(length, 0);
    }

    pub fn u1(&mut self, value: u8) {
        self.0.push(value);
    }

    pub fn u4(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    pub fn f8(&mut self, value: f64) {
        self.align(8);
        self.0.extend(value.to_le_bytes());
    }

    /// Text, with a zero byte behind it.
    pub fn text(&mut self, text: &str) {
        self.u4(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    /// A sequence of bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.u4(bytes.len() as u32);
        self.0.extend(bytes);
    }

    pub fn done(self) -> Vec<u8> {
        self.0
    }
}

/// A message that is being read.
pub(super) struct Decoder<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    /// # Errors
    /// If the message is of another encoding.
    pub fn new(message: &'a [u8]) -> Result<Self, String> {
        let body = message.strip_prefix(&HEADER[..2]).and_then(|rest| rest.get(2..));
        let body = body.ok_or("a message is not in plain little-endian CDR")?;
        Ok(Self { body, at: 0 })
    }

    fn take(&mut self, size: usize, alignment: usize) -> Result<&'a [u8], String> {
        let from = self.at.next_multiple_of(alignment);
        let end = from.checked_add(size);
        let bytes =
            end.and_then(|end| self.body.get(from..end)).ok_or("a message ends too early")?;
        self.at = from + size;
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.take(N, N)?.try_into().map_err(|_| "a message ends too early".to_owned())
    }

    pub fn u1(&mut self) -> Result<u8, String> {
        Ok(self.array::<1>()?[0])
    }

    pub fn u4(&mut self) -> Result<u32, String> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn f8(&mut self) -> Result<f64, String> {
        self.array().map(f64::from_le_bytes)
    }

    pub fn text(&mut self) -> Result<&'a str, String> {
        let bytes = self.bytes()?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map_err(|_| "a name in a message is not text".to_owned())
    }

    pub fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.u4()? as usize;
        self.take(length, 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_behind_the_header() {
        let mut encoder = Encoder::new();
        encoder.u1(7);
        encoder.u4(0x0403_0201);
        encoder.text("ab");
        encoder.f8(1.0);
        let bytes = encoder.done();
        assert_eq!(bytes[..12], [0, 1, 0, 0, 7, 0, 0, 0, 1, 2, 3, 4]);
        assert_eq!(bytes[12..19], [3, 0, 0, 0, b'a', b'b', 0]);
        // 15 bytes behind the header, so one of padding.
        assert_eq!(bytes[20..], 1_f64.to_le_bytes());
        let mut decoder = Decoder::new(&bytes).unwrap();
        assert_eq!((decoder.u1(), decoder.u4()), (Ok(7), Ok(0x0403_0201)));
        assert_eq!((decoder.text(), decoder.f8()), (Ok("ab"), Ok(1.0)));
        assert!(decoder.u1().is_err());
    }

    #[test]
    fn a_length_beyond_the_message_is_refused() {
        let mut encoder = Encoder::new();
        encoder.u4(u32::MAX);
        let bytes = encoder.done();
        assert!(Decoder::new(&bytes).unwrap().bytes().is_err());
        assert!(Decoder::new(&[0, 0, 0, 0, 1]).is_err());
        assert!(Decoder::new(&[]).is_err());
    }
}
