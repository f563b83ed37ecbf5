//! Grey images: PGM and PNG. The size is checked before memory is used.

use std::io::Cursor;

use anyhow::{Context, bail, ensure};
use png::{Decoder, Limits, Transformations};

/// Largest number of pixels that are read: 8192 × 8192.
pub const MAX_PIXELS: u64 = 1 << 26;

/// A grey image, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// A byte for each pixel: 0 is black.
    pub grey: Vec<u8>,
}

fn check(width: u64, height: u64) -> anyhow::Result<(usize, usize)> {
    ensure!(width > 0 && height > 0, "it has no pixel");
    ensure!(
        width.saturating_mul(height) <= MAX_PIXELS,
        "it has {width} × {height} pixels: at most {MAX_PIXELS} are read: make it smaller or coarser"
    );
    Ok((usize::try_from(width)?, usize::try_from(height)?))
}

impl Image {
    /// Reads an image.
    ///
    /// # Errors
    /// If it is neither PGM nor PNG, is damaged, or has too many pixels.
    pub fn read(bytes: &[u8]) -> anyhow::Result<Self> {
        if bytes.starts_with(b"\x89PNG") {
            Self::read_png(bytes)
        } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
            Self::read_pgm(bytes)
        } else {
            bail!("it is neither PGM nor PNG")
        }
    }

    fn read_png(bytes: &[u8]) -> anyhow::Result<Self> {
        // A row of the widest image that is read.
        let limits = Limits { bytes: 8 << 26 };
        let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
        decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
        let header = decoder.read_header_info()?;
        ensure!(!header.interlaced, "it is interlaced: save it without");
        let (width, height) = check(header.width.into(), header.height.into())?;
        let mut reader = decoder.read_info()?;
        let channels = reader.output_color_type().0.samples();
        // Alpha is left out.
        let colours = if channels > 2 { 3 } else { 1 };
        let mut grey = Vec::new();
        while let Some(row) = reader.next_row()? {
            grey.extend(row.data().chunks_exact(channels).map(|pixel| {
                let sum: usize = pixel.iter().take(colours).map(|&part| usize::from(part)).sum();
                u8::try_from(sum / colours).unwrap_or(u8::MAX)
            }));
        }
        ensure!(grey.len() == width * height, "it ends too early");
        Ok(Self { width, height, grey })
    }

    fn read_pgm(bytes: &[u8]) -> anyhow::Result<Self> {
        let mut header = Header { rest: bytes.get(2..).unwrap_or_default() };
        let (width, height) = check(header.number()?, header.number()?)?;
        let most = header.number()?;
        ensure!((1..=65_535).contains(&most), "its largest value {most} is not within 1 and 65535");
        let grey = |value: u64| u8::try_from(value.min(most) * 255 / most).unwrap_or(u8::MAX);
        let count = width * height;
        let pixels: Vec<u8> = if bytes.starts_with(b"P2") {
            // A pixel has at least one digit and a space.
            ensure!(header.rest.len() >= count, "it ends too early");
            (0..count).map(|_| header.number().map(grey)).collect::<anyhow::Result<_>>()?
        } else {
            let data = header.rest.get(1..).unwrap_or_default();
            let size = if most > 255 { 2 } else { 1 };
            ensure!(data.len() >= count * size, "it ends too early");
            let value =
                |bytes: &[u8]| bytes.iter().fold(0, |sum, &byte| sum << 8 | u64::from(byte));
            data.chunks_exact(size).take(count).map(|bytes| grey(value(bytes))).collect()
        };
        Ok(Self { width, height, grey: pixels })
    }

    /// The image as PGM.
    #[must_use]
    pub fn pgm(&self) -> Vec<u8> {
        let mut bytes = format!("P5\n{} {}\n255\n", self.width, self.height).into_bytes();
        bytes.extend(&self.grey);
        bytes
    }
}

struct Header<'b> {
    rest: &'b [u8],
}

impl Header<'_> {
    /// The next number, after spaces and comments.
    fn number(&mut self) -> anyhow::Result<u64> {
        loop {
            let space = self.rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
            self.rest = self.rest.get(space..).unwrap_or_default();
            if self.rest.first() != Some(&b'#') {
                break;
            }
            let line = self.rest.iter().take_while(|&&byte| byte != b'\n').count();
            self.rest = self.rest.get(line..).unwrap_or_default();
        }
        let digits = self.rest.iter().take(20).take_while(|byte| byte.is_ascii_digit()).count();
        let (number, rest) = self.rest.split_at(digits);
        self.rest = rest;
        let number = std::str::from_utf8(number)?;
        number.parse().context("a number is missing in the PGM")
    }
}
