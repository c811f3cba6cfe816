//! Pages in a real browser, against the real server and a simulated robot that drives meanwhile.

mod cdp;
mod guide;
mod look;
mod watch;
mod world;

use crate::cdp::Browser;
use crate::watch::Watched;
use crate::world::World;
use anyhow::{Context, ensure};
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// There is no browser, so nothing was tried.
const SKIPPED: u8 = 77;
/// The browser's recogniser, replaced.
const RECOGNISER: &str = include_str!("recogniser.js");

/// Try the pages in a real browser: type, talk, ask, mend, lose the connection
#[derive(Parser)]
#[command(after_help = "\
Examples:
  browse --screenshots pictures
  browse --sentences 200 --cut 60
  browse --watch 3600 --phones 20 --talk-each 10
  browse --watch 60 --log tour.clf.gz --speed 50
  unshare --user --map-root-user --net sh -c 'ip link set lo up && browse'

Ends with 77 if there is no browser (Debian: apt install chromium).")]
struct Args {
    /// Keep pictures of the pages here
    #[arg(long, value_name = "DIR")]
    screenshots: Option<PathBuf>,
    /// Sentences said while network and server come and go
    #[arg(long, default_value_t = 12)]
    sentences: usize,
    /// The longest time they are away, seconds
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    cut: f64,
    /// Of what goes away when
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Instead of all that: phones watch for so long, seconds
    #[arg(long, value_name = "S")]
    watch: Option<f64>,
    /// How many
    #[arg(long, default_value_t = 1)]
    phones: usize,
    /// Meanwhile somebody says a sentence each so many seconds
    #[arg(long, value_name = "S")]
    talk_each: Option<f64>,
    /// The robot plays this log, in the place of a simulated one
    #[arg(long, value_name = "FILE", requires = "watch")]
    log: Option<PathBuf>,
    /// So many times its pace
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Let the robot drive for so long before anybody looks, seconds
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    ahead: f64,
    /// The browser [default: the first of chromium, chromium-browser, google-chrome, chrome]
    #[arg(long)]
    browser: Option<PathBuf>,
    /// The server's program [default: toponym-server beside this one]
    #[arg(long)]
    server: Option<PathBuf>,
}

fn main() -> anyhow::Result<ExitCode> {
    let args = Args::parse();
    let Some(program) = args.browser.clone().or_else(cdp::find) else {
        eprintln!("skipped: there is no browser (Debian: apt install chromium)");
        return Ok(ExitCode::from(SKIPPED));
    };
    let beside = std::env::current_exe()?.with_file_name("toponym-server");
    let mut world = World::start(args.server.as_deref().unwrap_or(&beside))?;
    let browser = Browser::start(&program, &world.host)?;
    if let Some(folder) = &args.screenshots {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    match args.watch {
        Some(seconds) => {
            match &args.log {
                Some(log) => world.play(log, args.speed)?,
                None => world.drive(seconds + args.ahead)?,
            }
            std::thread::sleep(Duration::from_secs_f64(args.ahead));
            let how = Watched { phones: args.phones, seconds, talk_each_s: args.talk_each };
            println!("{}", watch::watch(&browser, &world, how)?);
        }
        None => scenes(&args, &browser, &mut world)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// One guide and one who looks, one scene after the other.
fn scenes(args: &Args, browser: &Browser, world: &mut World) -> anyhow::Result<()> {
    let begin = Instant::now();
    let done = |what: &str| println!("{:6.1} s  {what}", begin.elapsed().as_secs_f64());
    let pictures = args.screenshots.as_deref();
    world.drive(90.0 + args.sentences as f64 * (1.0 + args.cut / 20.0))?;
    let (phone, desk) = (browser.page(390, 844)?, browser.page(1280, 800)?);
    phone.prepare(RECOGNISER)?;
    guide::open(&phone, &world.host)?;
    done("the guide's page knows the robot");
    look::open(&desk, &world.host)?;
    done("the map shows walls");
    let (heard_s, placed_s) = guide::types(&phone, "This is the kitchen.")?;
    done(&format!("typed: heard after {:.0} ms, in the map after {:.0} ms", 1e3 * heard_s, 1e3 * placed_s));
    look::shows(&desk, "kitchen")?;
    guide::is_driven(&phone, 12.0)?;
    guide::talks(&phone, &[("this is the library", 0.8), ("this is the lie berry", 0.1)])?;
    look::shows(&desk, "library")?;
    done("talked: both names are on the map");
    guide::takes_back(&phone, "this is the library")?;
    desk.until(
        "![...document.querySelectorAll('#rooms button')].some(b => b.textContent.includes('library'))",
        "gone",
    )?;
    done("taken back: it is gone");
    let words = guide::asks(&phone, "Where is the kitchen?")?;
    ensure!(words.to_lowercase().contains("kitchen"), "asked for the kitchen: {words}");
    let found = look::asks(&desk, "where is the kitchen?")?;
    ensure!(found.contains("kitchen"), "asked for the kitchen: {found}");
    let unknown = look::asks(&desk, "where is the sauna?")?;
    ensure!(unknown.contains("Not in this map"), "asked for the sauna: {unknown}");
    done(&format!("asked: {words}"));
    look::renames(&desk, "kitchen", "canteen", "This is the kitchen.")?;
    desk.click("#more")?;
    desk.until("document.getElementById('more').ariaPressed === 'true'", "doubt shown")?;
    done("renamed at the map");
    for (page, width) in [(&phone, "phone"), (&desk, "desk")] {
        let name = if width == "phone" { "guide_phone" } else { "map_desk" };
        look::inspect(page, name, pictures)?;
    }
    let (small, large) = (browser.page(390, 844)?, browser.page(1280, 800)?);
    look::open(&small, &world.host)?;
    look::inspect(&small, "map_phone", pictures)?;
    guide::open(&large, &world.host)?;
    look::inspect(&large, "guide_desk", pictures)?;
    done("labels, contrast and sizes, in light and dark, on phone and desk");
    done(&guide::is_cut_off(&phone, world, args.sentences, args.cut, args.seed)?);
    for page in [&phone, &desk, &small, &large] {
        let traffic = page.traffic()?;
        ensure!(traffic.outward.is_empty(), "asked of other hosts: {:?}", traffic.outward);
        ensure!(traffic.complaints.is_empty(), "the browser complains: {:?}", traffic.complaints);
    }
    done("nothing was asked of any other host");
    Ok(())
}
