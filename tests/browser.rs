//! Pages in a real browser, if there is one: `browse`, with short outages.

use std::process::Command;

/// What `browse` ends with if there is no browser.
const SKIPPED: i32 = 77;

#[test]
fn pages_do_what_people_do_with_them() {
    let tried = Command::new(env!("CARGO_BIN_EXE_browse")).output().expect("it can be started");
    let told = String::from_utf8_lossy(&tried.stdout);
    println!("{told}");
    if tried.status.code() == Some(SKIPPED) {
        println!("skipped: there is no browser here");
        return;
    }
    assert!(tried.status.success(), "{told}{}", String::from_utf8_lossy(&tried.stderr));
}
