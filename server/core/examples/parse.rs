//! Reads sentences from standard input, one a line, and prints what each says, as JSON:
//! `{"text": "this is the gym", "parse": "label(here,gym)"}`.

use std::io::{self, BufRead, Write};

fn main() -> io::Result<()> {
    let mut out = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        let text = line?;
        let parse = toponym_core::language::parse(&text).notation;
        writeln!(out, "{}", serde_json::json!({ "text": text, "parse": parse }))?;
    }
    Ok(())
}
