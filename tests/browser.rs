//! Pages in a real browser, if there is one: `browse`, with short outages; where the machine lets it, without a way out.

use std::process::Command;

/// What `browse` ends with if there is no browser.
const SKIPPED: i32 = 77;
/// Runs what follows in a network of its own, in which there is nothing but itself.
const ALONE: [&str; 7] =
    ["--user", "--map-root-user", "--net", "sh", "-c", "ip link set lo up && exec \"$@\"", "sh"];

#[test]
fn pages_do_what_people_do_with_them() {
    let alone = || Command::new("unshare");
    let is_alone = alone().args(ALONE).arg("true").status().is_ok_and(|status| status.success());
    let program = env!("CARGO_BIN_EXE_browse");
    let tried =
        if is_alone { alone().args(ALONE).arg(program).output() } else { Command::new(program).output() };
    let tried = tried.expect("it can be started");
    let told = String::from_utf8_lossy(&tried.stdout);
    println!("{told}");
    if tried.status.code() == Some(SKIPPED) {
        println!("skipped: there is no browser here");
        return;
    }
    assert!(tried.status.success(), "{told}{}", String::from_utf8_lossy(&tried.stderr));
}
