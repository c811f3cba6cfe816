//! Somebody who looks at the map, asks it, and mends names; and how pages look.

use crate::cdp::Page;
use anyhow::ensure;
use std::path::Path;

/// What is wrong with a page for whoever sees badly, has large thumbs, or uses a screen reader.
const CHECKS: &str = include_str!("checks.js");

/// Opens the map, and waits for its walls.
///
/// # Errors
/// If they don't come.
pub fn open(page: &Page, host: &str) -> anyhow::Result<()> {
    page.open(&format!("http://{host}/"))?;
    page.until("document.getElementById('map').value === 'main'", "the map")?;
    page.until("document.getElementById('view').ariaBusy === 'false'", "its walls")
}

/// The button of a room in the list.
fn room(name: &str) -> String {
    format!("[...document.querySelectorAll('#rooms button')].find(b => b.textContent.includes({name:?}))")
}

/// Waits until a name is in the list of rooms.
///
/// # Errors
/// If it does not come.
pub fn shows(page: &Page, name: &str) -> anyhow::Result<()> {
    page.until(&room(name), &format!("a room {name:?}"))
}

/// Asks; tells the answers, a line each.
///
/// # Errors
/// If there are none.
pub fn asks(page: &Page, question: &str) -> anyhow::Result<String> {
    page.eval("document.getElementById('name').value = ''")?;
    page.enter("#name", question)?;
    let is_there = format!("document.querySelector('#answer h2')?.textContent === {question:?}");
    page.until(&is_there, &format!("an answer to {question:?}"))?;
    Ok(page.eval("document.querySelector('#answer ul').innerText")?.as_str().unwrap_or_default().to_owned())
}

/// Opens a room, reads the sentence behind its name, and gives it another name.
///
/// # Errors
/// If any of that is not there.
pub fn renames(page: &Page, from: &str, to: &str, because: &str) -> anyhow::Result<()> {
    page.eval(&format!("{}.click()", room(from)))?;
    page.until(
        &format!("document.querySelector('#room .because')?.textContent.includes({because:?})"),
        "the sentence behind a name",
    )?;
    page.eval(
        "[...document.querySelectorAll('#room button')].find(b => b.textContent === 'Rename').click()",
    )?;
    page.enter("#room form input", to)?;
    shows(page, to)?;
    page.until(&format!("!{}", room(from)), "the old name gone")
}

/// Checks a page in light and dark colours, and keeps pictures of it.
///
/// # Errors
/// With all that is wrong; if a picture can't be written.
pub fn inspect(page: &Page, name: &str, pictures: Option<&Path>) -> anyhow::Result<()> {
    for (dark, colours) in [(false, "light"), (true, "dark")] {
        page.dark(dark)?;
        if let Some(folder) = pictures {
            std::fs::write(folder.join(format!("{name}_{colours}.png")), page.picture()?)?;
        }
        let wrong = page.eval(CHECKS)?;
        let wrong: Vec<&str> = wrong.as_array().into_iter().flatten().filter_map(|w| w.as_str()).collect();
        ensure!(wrong.is_empty(), "{name}, {colours}:\n{}", wrong.join("\n"));
    }
    page.dark(false)
}
