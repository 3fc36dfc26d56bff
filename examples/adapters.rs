//! Lists the machine's adapters and whether lightfall runs on each. Exit status 1 if it runs on none.
//!
//! `cargo run --release --example adapters`

#[path = "common/adapter.rs"]
#[allow(dead_code, reason = "only the list is wanted here")]
mod adapter;

fn main() {
    let adapters = adapter::list();
    for (adapter, is_usable) in &adapters {
        let info = adapter.get_info();
        let verdict = if *is_usable { "usable" } else { "not WebGPU compliant" };
        println!("{} ({}, {:?}): {verdict}", info.name, info.backend, info.device_type);
    }
    if !adapters.iter().any(|(_, is_usable)| *is_usable) {
        eprintln!("no adapter that runs core WebGPU; run examples/setup-adapter.sh");
        std::process::exit(1);
    }
}
