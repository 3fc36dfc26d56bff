//! Command lines whose mistakes get one line and exit status 2.

/// Parses the program's own arguments. `--help` prints and ends; a mistake gets one line on stderr that begins with the
/// program's name, and exit status 2.
pub(crate) fn parse<T: clap::Parser>(program: &str) -> T {
    T::try_parse().unwrap_or_else(|error| {
        if error.use_stderr() {
            // The first paragraph says what is wrong; usage follows.
            let text = error.to_string();
            let what: Vec<&str> = text.lines().take_while(|l| !l.is_empty()).map(str::trim).collect();
            eprintln!("{program}: {}", what.join(" ").trim_start_matches("error: "));
            std::process::exit(2);
        }
        error.exit()
    })
}

/// The parts of an argument of `--set`, trimmed.
pub(crate) fn key_and_value(pair: &str) -> Result<(&str, &str), String> {
    let (key, value) = pair
        .split_once('=')
        .ok_or_else(|| format!("--set {pair:?}: expected KEY=VALUE"))?;
    Ok((key.trim(), value.trim()))
}
