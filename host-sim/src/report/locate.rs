//! placeholder until merged
use super::Section;
use crate::diagnose::locate::Located;
/// Charts.
pub fn charts(_section: &mut Section, _located: &Located) {}
