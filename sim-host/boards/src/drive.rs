//! The USB drive of a board in its boot mode.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::{Board, Uf2};
use anyhow::{Context, bail, ensure};

/// The file that each such drive has.
const INFO: &str = "INFO_UF2.TXT";
/// Where drives are mounted, in a folder of their own or of their user.
const MOUNTS: [&str; 4] = ["/media", "/run/media", "/mnt", "/Volumes"];

/// A drive.
#[derive(Debug)]
pub struct Drive {
    folder: PathBuf,
}

impl Drive {
    /// The named drive, or the only one of this board that is mounted.
    ///
    /// # Errors
    /// If it is the drive of another board, or none or several are found.
    pub fn find(named: Option<&Path>, board: &Board, usb: &Uf2) -> anyhow::Result<Self> {
        if let Some(folder) = named {
            let id = board_of(folder).with_context(|| {
                format!(
                    "--to: {} has no {INFO}: name the drive of a board that was plugged in with BOOTSEL held",
                    folder.display()
                )
            })?;
            ensure!(
                id == usb.drive,
                "--to: {} is the drive of {id}, not of a {} ({})",
                folder.display(),
                board.title,
                usb.drive
            );
            return Ok(Self { folder: folder.to_owned() });
        }
        let mounted = mounted(&MOUNTS.map(Path::new), &usb.drive);
        match mounted.as_slice() {
            [folder] => Ok(Self { folder: folder.clone() }),
            [] => bail!(
                "the drive {} of a {} is not mounted: hold BOOTSEL while you plug the board in, and repeat this; or name the \
                 drive by --to, or write a file by --out and load it by `picotool load -x FILE`",
                usb.drive,
                board.title
            ),
            several => {
                let names: Vec<_> = several.iter().map(|it| it.display().to_string()).collect();
                bail!("there are several drives: name one by --to: {}", names.join(", "))
            }
        }
    }

    /// The place of a program on it.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.uf2"))
    }
}

/// The mounted drives of a board.
fn mounted(roots: &[&Path], id: &str) -> Vec<PathBuf> {
    let below = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
        entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect()
    };
    let first = roots.iter().flat_map(|root| below(root));
    let mut drives: Vec<_> = first
        .flat_map(|folder| if is_drive(&folder) { vec![folder] } else { below(&folder) })
        .filter(|folder| board_of(folder).as_deref() == Some(id))
        .collect();
    drives.sort();
    drives
}

fn is_drive(folder: &Path) -> bool {
    folder.join(INFO).is_file()
}

/// The `Board-ID` of a drive; `None` if it is no drive of a board.
fn board_of(folder: &Path) -> Option<String> {
    let text = fs::read_to_string(folder.join(INFO)).ok()?;
    let id = text.lines().find_map(|line| line.strip_prefix("Board-ID:"));
    Some(id.unwrap_or_default().trim().to_owned())
}

/// Copies a file to a drive. Not by a temporary name: the board restarts when it has the last block, and the drive is gone.
///
/// # Errors
/// If it cannot be written.
pub fn copy(bytes: &[u8], to: &Path) -> anyhow::Result<()> {
    let mut file = File::create(to).with_context(|| format!("cannot write {}", to.display()))?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    if to.parent().is_some_and(is_drive) {
        written.with_context(|| format!("cannot write {}", to.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_are_found_in_folders_of_users_and_directly() {
        let root = tempfile::tempdir().unwrap();
        let drive = |name: &str, id: &str| {
            let folder = root.path().join(name);
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join(INFO), format!("UF2 Bootloader v3.0\nBoard-ID: {id}\r\n"))
                .unwrap();
            folder
        };
        let direct = drive("drive", "RPI-RP2");
        let of_user = drive("user/RPI-RP2", "RPI-RP2");
        drive("user/RP2350", "RP2350");
        drive("a/b/too-deep", "RPI-RP2");
        fs::create_dir(root.path().join("user/stick")).unwrap();
        let missing = root.path().join("missing");
        assert_eq!(mounted(&[root.path(), &missing], "RPI-RP2"), [direct, of_user]);
        assert_eq!(mounted(&[root.path()], "other").len(), 0);
    }
}
