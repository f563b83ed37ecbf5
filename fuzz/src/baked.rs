//! A baked map: one that [`Map::read`] accepts must answer every query correctly.

use sonarfix::geometry::pose::Point;
use sonarfix::geometry::units::Metres;
use sonarfix::map::image::{MAGIC, VERSION, checksum};
use sonarfix::map::{Map, MapError, Wall, WallId};
use sonarfix_map::{BakeError, bake};

use crate::bytes::Bytes;

/// Reads the bytes as they are, the same with a valid header and checksum, and a map that is baked from walls in the bytes and then
/// damaged.
///
/// # Panics
/// If an invariant is violated.
pub fn baked_map(bytes: &[u8]) {
    let _ = ask(bytes, bytes);
    if let Some(content) = bytes.len().checked_sub(4).and_then(|end| bytes.get(8..end)) {
        let _ = ask(&sealed(content), bytes);
    }
    baked_walls(bytes);
}

/// Bakes walls from the bytes. The image must be accepted; with some bytes changed it may be.
fn baked_walls(bytes: &[u8]) {
    let mut drawn = Bytes::new(bytes);
    let walls = walls(&mut drawn);
    let image = match bake(&walls) {
        Ok(image) => image,
        Err(BakeError::NoWall) => return assert!(walls.is_empty()),
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    assert_eq!(ask(&image, bytes), Ok(()), "{walls:?}");
    let map = Map::read(&image).map(|map| map.walls().map(|(_, wall)| wall).collect());
    assert_eq!(map, Ok(walls));

    let mut content = image[8..image.len() - 4].to_vec();
    for _ in 0..=drawn.byte() % 4 {
        let at = drawn.word() as usize % content.len();
        content[at] ^= drawn.byte();
    }
    let _ = ask(&sealed(&content), bytes);
}

/// Up to 32 walls, most of them in one house, some of them equal.
fn walls(bytes: &mut Bytes) -> Vec<Wall> {
    let count = bytes.byte() % 33;
    let size = if bytes.byte() < 128 { 6.0 } else { 60.0 };
    let mut corner = || Point::new(bytes.number(size), bytes.number(size));
    (0..count).filter_map(|_| Wall::new(corner(), corner()).ok()).collect()
}

/// The image of this content.
fn sealed(content: &[u8]) -> Vec<u8> {
    let mut image = [&MAGIC, &VERSION.to_le_bytes(), content].concat();
    image.extend(checksum(&image).to_le_bytes());
    image
}

/// Runs every query of a map, at places from `bytes` and at its edges.
fn ask(image: &[u8], bytes: &[u8]) -> Result<(), MapError> {
    let map = Map::read(image)?;
    let walls: Vec<_> = map.walls().collect();
    assert_eq!(walls.len(), map.count() as usize);
    assert_eq!(map.wall(WallId(map.count())), None);
    for &(id, wall) in &walls {
        assert!(wall.stored().iter().all(|v| v.is_finite()) && wall.to().is_finite(), "{wall:?}");
        assert!(wall.length() >= Wall::SHORTEST && map.wall(id) == Some(wall), "{id:?}");
    }
    let Some(grid) = map.grid() else { panic!("a baked map has a grid") };
    let mut questions = Bytes::new(bytes.get(32..).unwrap_or_default());
    let mut any = || Point::new(questions.number(70.0), questions.number(70.0));
    let points = [grid.origin(), any(), any(), any()];
    let corners = walls.first().map(|(_, wall)| [wall.from(), wall.to()]);
    for point in points.into_iter().chain(corners.into_iter().flatten()) {
        for reach in [0.0, 0.5, 4.0, 100.0, f32::MAX, f32::INFINITY, f32::NAN, -1.0] {
            check_near(&map, &walls, point, reach);
        }
    }
    Ok(())
}

/// Every returned wall is in the map and is returned once; every wall within reach is returned.
fn check_near(map: &Map, walls: &[(WallId, Wall)], point: Point, reach: f32) {
    let mut given = vec![false; walls.len()];
    for (id, wall) in map.near(point, Metres(reach)) {
        let place = id.0 as usize;
        assert_eq!(walls.get(place), Some(&(id, wall)), "not of the map");
        assert!(!std::mem::replace(&mut given[place], true), "{id:?} is returned twice");
    }
    if !point.is_finite() {
        return;
    }
    for (&(id, wall), given) in walls.iter().zip(given) {
        // A millionth exceeds the rounding of the distance by far.
        let is_within = distance(&wall, point) < f64::from(reach) * (1.0 - 1e-6);
        assert!(given || !is_within, "{id:?} is within {reach} m of {point:?}");
    }
}

/// The distance of a point from a wall, between its ends.
fn distance(wall: &Wall, point: Point) -> f64 {
    let from = |end: Point| {
        let difference = |a: Metres, b: Metres| f64::from(a.0) - f64::from(b.0);
        (difference(end.x, point.x), difference(end.y, point.y))
    };
    let ((x, y), (to_x, to_y)) = (from(wall.from()), from(wall.to()));
    let (dx, dy) = (to_x - x, to_y - y);
    let square = dx * dx + dy * dy;
    let share = if square > 0.0 { (-(x * dx + y * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    (x + share * dx).hypot(y + share * dy)
}
