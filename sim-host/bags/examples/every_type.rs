//! Writes a bag with a message of every type of this program, all of zeros, into a folder: for `xtask/bags/proof.py`, by
//! which another program reads them.

use std::path::Path;

use sonarfix_bags::writer::{Durability, Writer};
use sonarfix_ros_messages::messages;

fn main() -> anyhow::Result<()> {
    let folder = std::env::args().nth(1).ok_or_else(|| anyhow::anyhow!("name a folder"))?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let mut out = Writer::new(std::fs::File::create(folder.join("every_type_0.mcap"))?)?;
    for (kind, (name, bytes)) in messages::definitions().iter().zip(messages::zeros()?) {
        out.write_bytes(&format!("/{name}"), kind, Durability::Volatile, 1, &bytes)?;
    }
    let (_, metadata) = out.end("every_type_0.mcap")?;
    std::fs::write(folder.join("metadata.yaml"), metadata)?;
    Ok(())
}
