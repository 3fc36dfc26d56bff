//! placeholder
use crate::Arguments;
use crate::common::adapter::Gpu;
pub(crate) fn table(_: &Gpu, _: &Arguments) -> Result<(), String> {
    Ok(())
}
