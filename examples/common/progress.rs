//! How far long work is.

use indicatif::ProgressBar;
use std::io::IsTerminal;

/// A bar of so many steps on a terminal, nothing in a pipe.
pub(crate) fn bar(steps: u64) -> ProgressBar {
    if std::io::stderr().is_terminal() && steps > 1 {
        ProgressBar::new(steps)
    } else {
        ProgressBar::hidden()
    }
}
