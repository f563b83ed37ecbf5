//! Databases of `SQLite`, read only: the rows of a table, from the first to the last (<https://sqlite.org/fileformat2.html>).
//!
//! Nothing of a file is trusted. Every page of a table and every page of its long rows is read at most once, so that the work is
//! bounded by the size of the file, and a row by [`MOST_ROW`].
//!
//! | module | what |
//! |---|---|
//! | `pages` | the pages of a file |
//! | `record` | the values of a row |
//! | `columns` | the names of a table's columns, from the text that made it |
//! | `error` | why a database cannot be read |
//! | this one | the tree of a table |

mod columns;
mod error;
mod pages;
mod record;

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;

pub use columns::Columns;
pub use error::{MOST_ROW, SqlError};
use pages::{Page, Pages};
pub use record::{Row, SqlValue};
use record::{integer, varint};

/// The deepest tree. Those of `SQLite` are less deep, whatever their size.
const DEEPEST: usize = 24;
/// Types of pages: inner page and leaf of a table.
const INNER: u8 = 5;
const LEAF: u8 = 13;

/// A database.
#[derive(Debug)]
pub struct Database<R> {
    pages: Pages<R>,
    /// Name, first page and text of each table.
    tables: Vec<(String, u32, String)>,
}

impl Database<io::BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// [`SqlError`], if it cannot be read or is no database.
    pub fn open(path: &Path) -> Result<Self, SqlError> {
        Self::of(io::BufReader::with_capacity(1 << 16, File::open(path)?))
    }
}

impl<R: Read + Seek> Database<R> {
    /// Reads a database from its bytes.
    ///
    /// # Errors
    /// [`SqlError`], if they cannot be read or are no database.
    pub fn of(bytes: R) -> Result<Self, SqlError> {
        let mut database = Self { pages: Pages::of(bytes)?, tables: Vec::new() };
        let mut tables = Vec::new();
        // The first page is the root of the table of tables: type, name, table's name, first page, text.
        database.walk(1, &mut |row| {
            let mut values = row.values.into_iter();
            let mut next = || values.next().unwrap_or(SqlValue::Null);
            let (kind, name, _, page, text) = (next(), next(), next(), next(), next());
            let is_table = matches!(&kind, SqlValue::Text(kind) if kind == "table");
            if let (true, SqlValue::Text(name), SqlValue::Integer(page), SqlValue::Text(text)) =
                (is_table, name, page, text)
                && let Ok(page) = u32::try_from(page)
            {
                tables.push((name, page, text));
            }
            Ok::<_, SqlError>(())
        })?;
        database.tables = tables;
        Ok(database)
    }

    /// Whether there is a table of this name.
    #[must_use]
    pub fn has_table(&self, name: &str) -> bool {
        self.tables.iter().any(|(table, ..)| table == name)
    }

    /// The columns of a table.
    ///
    /// # Errors
    /// [`SqlError::NoTable`].
    pub fn columns(&self, table: &str) -> Result<Columns, SqlError> {
        let (name, _, text) = self.table(table)?;
        Ok(Columns::of(name, text))
    }

    fn table(&self, name: &str) -> Result<&(String, u32, String), SqlError> {
        let found = self.tables.iter().find(|(table, ..)| table == name);
        found.ok_or_else(|| SqlError::NoTable(name.to_owned()))
    }

    /// Passes each row of a table to `take`, in the order of their numbers.
    ///
    /// # Errors
    /// [`SqlError`] as an `E`, if the table is missing or damaged; what `take` returns.
    pub fn rows<E: From<SqlError>>(
        &mut self,
        table: &str,
        take: &mut dyn FnMut(Row) -> Result<(), E>,
    ) -> Result<(), E> {
        let root = self.table(table)?.1;
        self.walk(root, take)
    }

    /// The rows of the tree from this page on, without recursion.
    fn walk<E: From<SqlError>>(
        &mut self,
        root: u32,
        take: &mut dyn FnMut(Row) -> Result<(), E>,
    ) -> Result<(), E> {
        let count = self.pages.count();
        let mut left = count;
        let mut left_over = LeftOver { pages: count, bytes: 0 };
        // Pages with the number of the next cell.
        let mut path: Vec<(Page, u32)> = vec![(self.pages.read(root)?, 0)];
        while let Some((page, next)) = path.last_mut() {
            let tree = Tree::of(page)?;
            if tree.kind == LEAF {
                left_over.bytes = self.pages.usable();
                for cell in 0..tree.cells {
                    take(row(&mut self.pages, page, tree.cell(page, cell)?, &mut left_over)?)?;
                }
                path.pop();
                continue;
            }
            let Some(child) = tree.child(page, *next)? else {
                path.pop();
                continue;
            };
            *next += 1;
            let number = page.number;
            let damage = |what| SqlError::Page { page: number, what };
            left = left.checked_sub(1).ok_or_else(|| damage("its tree has a loop"))?;
            if path.len() >= DEEPEST {
                return Err(damage("its tree is too deep").into());
            }
            path.push((self.pages.read(child)?, 0));
        }
        Ok(())
    }
}

/// The header of a page in a tree.
struct Tree {
    kind: u8,
    cells: u32,
    /// Where the places of the cells begin.
    places: usize,
    /// The child behind the last cell of an inner page.
    last: u32,
}

impl Tree {
    fn of(page: &Page) -> Result<Self, SqlError> {
        let start = page.start();
        let kind = page.byte(start)?;
        let cells = u32::from(page.short(start + 3)?);
        match kind {
            LEAF => Ok(Self { kind, cells, places: start + 8, last: 0 }),
            INNER => Ok(Self { kind, cells, places: start + 12, last: page.word(start + 8)? }),
            _ => Err(page.damage("it is no page of a table")),
        }
    }

    fn cell(&self, page: &Page, cell: u32) -> Result<usize, SqlError> {
        Ok(page.short(self.places + 2 * cell as usize)?.into())
    }

    /// A child of an inner page, in the order of the rows.
    fn child(&self, page: &Page, next: u32) -> Result<Option<u32>, SqlError> {
        Ok(match next {
            next if next < self.cells => Some(page.word(self.cell(page, next)?)?),
            next if next == self.cells => Some(self.last),
            _ => None,
        })
    }
}

/// What may still be read of the rows of a table whose rows do not overlap.
struct LeftOver {
    /// Pages of long rows.
    pages: u32,
    /// Bytes on this leaf.
    bytes: usize,
}

/// The row at a place on a leaf, with what of it lies on pages of its own.
fn row<R: Read + Seek>(
    pages: &mut Pages<R>,
    page: &Page,
    at: usize,
    left_over: &mut LeftOver,
) -> Result<Row, SqlError> {
    let mut rest = page.from(at)?;
    let short = || page.damage("a row is cut off");
    let bytes = varint(&mut rest).ok_or_else(short)?;
    let number = integer(varint(&mut rest).ok_or_else(short)?);
    if bytes > MOST_ROW {
        return Err(SqlError::LongRow { row: number, bytes });
    }
    let length = usize::try_from(bytes).map_err(|_| short())?;
    let here = pages.part_on_leaf(length);
    let overlap = || page.damage("its rows overlap");
    // A row of no bytes has a cell of two bytes.
    left_over.bytes = left_over.bytes.checked_sub(here + 2).ok_or_else(overlap)?;
    let mut payload = rest.get(..here).ok_or_else(short)?.to_vec();
    if here < length {
        let link = rest.get(here..here + 4).and_then(|link| link.try_into().ok());
        let mut next = u32::from_be_bytes(link.ok_or_else(short)?);
        while payload.len() < length {
            let looped = || page.damage("a long row has a loop");
            left_over.pages = left_over.pages.checked_sub(1).ok_or_else(looped)?;
            let long = pages.read(next)?;
            next = long.word(0)?;
            let part = long.from(4)?;
            payload.extend(part.iter().take(length - payload.len()));
        }
    }
    let values = record::values(&payload).ok_or_else(|| page.damage("the values of a row"))?;
    Ok(Row { number, values })
}

#[cfg(test)]
mod tests;
