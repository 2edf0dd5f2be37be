//! A unit that a tool holds.

use grey_box::rig::Rig;
use host_sim::fmu::{Component, KIND_FILE, Kind, RIG_FILE, Refusal, token};
use std::ffi::{CString, c_int};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::ptr;
use std::rc::Rc;

/// The status of a call, the same numbers in both standards.
pub const OK: c_int = 0;
/// The call failed, the unit is as before.
pub const ERROR: c_int = 3;
/// The unit cannot be used any more.
pub const FATAL: c_int = 4;

/// Says a line to the tool: status and message.
pub type Say = Box<dyn Fn(c_int, &CString)>;

/// A unit that a tool holds.
pub struct Instance {
    component: Component,
    say: Say,
}

impl Instance {
    /// Opens the unit whose resources lie in a folder.
    ///
    /// # Errors
    /// In words, where the resources cannot be read or belong to another description.
    pub fn open(resources: &Path, asked_token: Option<&str>, say: Say) -> Result<Self, String> {
        let rig = Rig::read(resources.join(RIG_FILE)).map_err(|error| error.to_string())?;
        let path = resources.join(KIND_FILE);
        let word =
            fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let kind = Kind::named(word.trim())
            .ok_or_else(|| format!("{}: expected plant, controller or observer", path.display()))?;
        let own = token(kind, &rig);
        if asked_token != Some(own.as_str()) {
            let asked = asked_token.unwrap_or("none");
            return Err(format!(
                "the description has the token {asked}, the unit {own}: expected the files of one \
                 archive, unchanged"
            ));
        }
        let component = Component::new(kind, &rig).map_err(|refusal| refusal.to_string())?;
        Ok(Self { component, say })
    }

    /// Does something with the unit; what goes wrong is said to the tool and becomes the status.
    pub fn answered(&mut self, work: impl FnOnce(&mut Component) -> Result<(), Refusal>) -> c_int {
        let component = &mut self.component;
        let (status, message) = match catch_unwind(AssertUnwindSafe(|| work(component))) {
            Ok(Ok(())) => return OK,
            Ok(Err(refusal)) => (ERROR, refusal.to_string()),
            Err(_) => (FATAL, "the unit broke down; please report it".to_owned()),
        };
        tell(&self.say, status, &message);
        status
    }

    /// A copy of the unit as it is.
    pub fn state(&self) -> Component {
        self.component.clone()
    }

    /// The unit as it was.
    pub fn restore(&mut self, state: &Component) {
        self.component = state.clone();
    }
}

/// Says a line.
pub fn tell(say: &Say, status: c_int, message: &str) {
    let no_zero: String = message.chars().filter(|c| *c != '\0').collect();
    if let Ok(line) = CString::new(no_zero) {
        say(status, &line);
    }
}

/// The folder that FMI 2.0 names by an address.
pub fn folder_of_address(address: &str) -> Option<PathBuf> {
    let Some(rest) = address.strip_prefix("file:") else {
        return (!address.contains("://")).then(|| PathBuf::from(address));
    };
    // file:/path, file:///path and file://localhost/path.
    let path = match rest.strip_prefix("//") {
        Some(named) => &named[named.find('/')?..],
        None => rest,
    };
    let path = percent_encoding::percent_decode_str(path)
        .decode_utf8()
        .ok()?;
    // file:///C:/path is C:/path.
    let has_drive = path.as_bytes().get(2) == Some(&b':') && path.starts_with('/');
    Some(PathBuf::from(if has_drive { &path[1..] } else { &path }))
}

/// A unit for a tool; null, and said, where there is none.
pub fn boxed(resources: &Path, asked_token: Option<&str>, say: Say) -> *mut Instance {
    let says = Rc::new(say);
    let own = Rc::clone(&says);
    let hand_over: Say = Box::new(move |status, line| own(status, line));
    let open = AssertUnwindSafe(|| Instance::open(resources, asked_token, hand_over));
    match catch_unwind(open) {
        Ok(Ok(instance)) => Box::into_raw(Box::new(instance)),
        Ok(Err(problem)) => {
            tell(&says, ERROR, &problem);
            ptr::null_mut()
        }
        Err(_) => ptr::null_mut(),
    }
}

/// Values of variables.
///
/// # Errors
/// Where there is no such variable.
pub fn get<T>(
    unit: &Component,
    references: &[u32],
    values: &mut [T],
    as_type: fn(f64) -> T,
) -> Result<(), Refusal> {
    for (reference, value) in references.iter().zip(values) {
        *value = as_type(unit.get(*reference)?);
    }
    Ok(())
}

/// Sets values of variables.
///
/// # Errors
/// As [`Component::set`].
pub fn set<T: Copy + Into<f64>>(
    unit: &mut Component,
    references: &[u32],
    values: &[T],
) -> Result<(), Refusal> {
    let pairs = references.iter().zip(values);
    pairs
        .into_iter()
        .try_for_each(|(reference, value)| unit.set(*reference, (*value).into()))
}
