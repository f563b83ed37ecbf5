//! Lines of positions in a text.

/// Where the lines of a text begin.
pub(crate) struct Lines {
    starts: Vec<usize>,
}

impl Lines {
    pub fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Self { starts: std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect() }
    }

    /// The line of a position; lines count from 1.
    pub fn of(&self, at: usize) -> usize {
        self.starts.partition_point(|&start| start <= at)
    }

    /// The line of each position.
    pub fn of_each(&self, places: &[usize]) -> Vec<usize> {
        places.iter().map(|&place| self.of(place)).collect()
    }

    /// A line of the text; empty if there is no such line.
    pub fn text<'t>(&self, text: &'t str, line: usize) -> &'t str {
        let start = self.starts.get(line.wrapping_sub(1)).copied();
        start.and_then(|start| text.get(start..)?.lines().next()).unwrap_or_default()
    }
}
