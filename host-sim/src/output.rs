//! Files written: whole or not at all, and never two runs into one.
//!
//! Content goes into a temporary file of its own name in the folder of the
//! target, is flushed to the disk and then renamed over the target. So a reader
//! sees the old file or the new one; an interrupted run leaves the old one; two
//! runs with the same output leave the file of one of them, whole.
//!
//! A target that is a symbolic link stays one: the file that it leads to is
//! replaced. The new file keeps the mode of the old one.
//!
//! Limits: a crash or a kill leaves the temporary file, `NAME.XXXXXX.partial`,
//! beside the target. A hard link to the old file keeps the old content.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// Writes a file as a whole.
///
/// # Errors
/// If the folder or the file cannot be written; the target is then as before.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut pending = Pending::create(path)?;
    write(&mut pending)?;
    pending.finish()
}

/// A file that is being written and does not stand in its place yet.
///
/// Dropped without [`Pending::finish`], it is removed.
#[derive(Debug)]
pub struct Pending {
    file: BufWriter<NamedTempFile>,
    target: PathBuf,
}

impl Pending {
    /// Begins a file that will stand at `path`.
    ///
    /// # Errors
    /// If the path names no file or its folder cannot be written to.
    pub fn create(path: &Path) -> io::Result<Self> {
        let target = behind_links(path)?;
        let name = target.file_name().ok_or_else(|| {
            let problem = format!("{} names no file", path.display());
            io::Error::new(io::ErrorKind::InvalidInput, problem)
        })?;
        let prefix = format!("{}.", name.to_string_lossy());
        // Made as any other new file is: with the modes that the user's mask leaves.
        let file = Builder::new()
            .prefix(&prefix)
            .suffix(".partial")
            .make_in(folder_of(&target), |path| File::create_new(path))?;
        let (file, temporary) = file.into_parts();
        let file = NamedTempFile::from_parts(file, temporary);
        if let Ok(old) = fs::metadata(&target) {
            fs::set_permissions(file.path(), old.permissions())?;
        }
        Ok(Self {
            file: BufWriter::new(file),
            target,
        })
    }

    /// Flushes the file to the disk and puts it in its place.
    ///
    /// # Errors
    /// If the disk is full or the file cannot be renamed; the target is then as before.
    pub fn finish(self) -> io::Result<()> {
        let file = self.file.into_inner().map_err(|error| error.into_error())?;
        file.as_file().sync_all()?;
        file.persist(&self.target).map_err(|error| error.error)?;
        Ok(())
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// The folder that holds a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The path that a symbolic link leads to, also where nothing stands there yet.
pub(crate) fn behind_links(path: &Path) -> io::Result<PathBuf> {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        if !path.is_symlink() {
            return Ok(path);
        }
        let next = fs::read_link(&path)?;
        path = folder_of(&path).join(next);
    }
    let problem = format!("{} is a circle of links", path.display());
    Err(io::Error::new(io::ErrorKind::InvalidInput, problem))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let name = |entry: io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn prop_a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("old.txt");
        fs::write(&path, "old").expect("written");
        let broken = write_whole(&path, |out| {
            out.write_all(b"half of the new")?;
            Err(io::Error::other("broken"))
        });
        assert!(broken.is_err());
        assert_eq!(fs::read_to_string(&path).expect("read"), "old");
        assert_eq!(names(folder.path()), ["old.txt"]);
    }

    #[test]
    fn prop_writers_at_once_leave_the_whole_file_of_one() {
        const LINES: usize = 20_000;
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("out.txt");
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let path = &path;
                scope.spawn(move || {
                    write_whole(path, |out| {
                        (0..LINES).try_for_each(|_| writeln!(out, "{writer}"))
                    })
                    .expect("written");
                });
            }
        });
        let text = fs::read_to_string(&path).expect("read");
        let mut lines = text.lines();
        let first = lines.next().expect("a line");
        assert_eq!(text.lines().count(), LINES);
        assert!(lines.all(|line| line == first));
        assert_eq!(names(folder.path()), ["out.txt"]);
    }

    #[cfg(unix)]
    #[test]
    fn prop_link_and_mode_of_the_old_file_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let [file, link, dangling] =
            ["file", "link", "dangling"].map(|one| folder.path().join(one));
        fs::write(&file, "old").expect("written");
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("a mode");
        symlink("file", &link).expect("a link");
        symlink("later", &dangling).expect("a link");
        write_whole(&link, |out| out.write_all(b"new")).expect("written");
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).expect("read"), "new");
        let mode = fs::metadata(&file).expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        write_whole(&dangling, |out| out.write_all(b"made")).expect("written");
        assert!(dangling.is_symlink());
        assert_eq!(
            fs::read_to_string(folder.path().join("later")).expect("read"),
            "made"
        );
    }
}
