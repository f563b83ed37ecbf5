use std::io::Cursor;

use proptest::prelude::*;

use super::*;

/// A database of two pages: the table of tables, and a table of one leaf with these cells.
fn made(root: u8, page: &dyn Fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = vec![0; 1024];
    bytes[..16].copy_from_slice(b"SQLite format 3\0");
    bytes[16..18].copy_from_slice(&512_u16.to_be_bytes());
    bytes[59] = 1;
    let text = b"CREATE TABLE t(a INTEGER PRIMARY KEY, b TEXT)";
    let kinds = [23, 15, 15, 1, 13 + 2 * u8::try_from(text.len()).unwrap()];
    let row = [[6].as_slice(), &kinds, b"tablett", &[root], text].concat();
    let cell = [[u8::try_from(row.len()).unwrap(), 1].as_slice(), &row].concat();
    let at = 512 - cell.len();
    bytes[at..512].copy_from_slice(&cell);
    bytes[100] = 13;
    bytes[104] = 1;
    bytes[108..110].copy_from_slice(&u16::try_from(at).unwrap().to_be_bytes());
    page(&mut bytes[512..]);
    bytes
}

fn rows(bytes: Vec<u8>) -> Result<Vec<Row>, SqlError> {
    let mut rows = Vec::new();
    let mut database = Database::of(Cursor::new(bytes))?;
    database.rows("t", &mut |row| {
        rows.push(row);
        Ok::<_, SqlError>(())
    })?;
    Ok(rows)
}

/// A leaf with one row: null and the text `hi`.
fn leaf(page: &mut [u8]) {
    page[0] = 13;
    page[4] = 1;
    page[8..10].copy_from_slice(&500_u16.to_be_bytes());
    page[500..507].copy_from_slice(&[5, 9, 3, 0, 17, b'h', b'i']);
}

#[test]
fn a_row_is_read() {
    let row = Row { number: 9, values: vec![SqlValue::Null, SqlValue::Text("hi".into())] };
    assert_eq!(rows(made(2, &leaf)).unwrap(), [row]);
}

#[test]
fn damages_are_errors() {
    let error = |bytes| rows(bytes).unwrap_err().to_string();
    assert!(error(b"SQLite format 2 and more".to_vec()).contains("no SQLite database"));
    assert!(
        error(made(3, &leaf)).contains("page 3 of the database is damaged: it is not in the file")
    );
    assert!(error(made(2, &|_| {})).contains("it is no page of a table"));
    let torn = made(2, &leaf)[..1000].to_vec();
    assert!(error(torn).contains("torn"));
    let looped = error(made(2, &|page| {
        page[0] = 5;
        page[8..12].copy_from_slice(&2_u32.to_be_bytes());
    }));
    assert!(looped.contains("loop") || looped.contains("too deep"), "{looped}");
    let long = error(made(2, &|page| {
        leaf(page);
        page[500..509].copy_from_slice(&[0xff; 9]);
    }));
    assert!(long.contains("18446744073709551615 bytes"), "{long}");
    let overlapping = error(made(2, &|page| {
        leaf(page);
        page[4] = 200;
        for cell in 0..200 {
            page[8 + 2 * cell..10 + 2 * cell].copy_from_slice(&500_u16.to_be_bytes());
        }
    }));
    assert!(overlapping.contains("overlap"), "{overlapping}");
    // A row of 6,000 bytes whose rest is on a third page that leads to itself.
    let mut long = made(2, &|page| {
        leaf(page);
        page[8..10].copy_from_slice(&20_u16.to_be_bytes());
        page[20..23].copy_from_slice(&[0xae, 0x70, 1]);
        let here = 39 + (6000 - 39) % 508;
        page[23 + here..27 + here].copy_from_slice(&3_u32.to_be_bytes());
    });
    long.extend(3_u32.to_be_bytes());
    long.resize(1536, 0);
    let long = error(long);
    assert!(long.contains("a long row has a loop"), "{long}");
    assert!(rows(made(2, &leaf)[..90].to_vec()).is_err());
    let mut wide = made(2, &leaf);
    wide[59] = 2;
    assert!(error(wide).contains("UTF-16"));
}

proptest! {
    /// Any damage of a database is an error or other rows, at once.
    #[test]
    fn random_damage_does_no_harm(damages in proptest::collection::vec((0_usize..1024, any::<u8>()), 1..20)) {
        let mut bytes = made(2, &leaf);
        for (at, byte) in damages {
            bytes[at] = byte;
        }
        let _ = rows(bytes);
    }
}
