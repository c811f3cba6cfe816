//! Work that gives way to the filter: however much is asked, a robot's pose comes in time.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::Cell;
use std::sync::LazyLock;

/// How nice threads are that answer: of a processor that all want they get a tenth of what the filter gets.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// What nobody waits for, one after the other.
static AHEAD: LazyLock<Option<ThreadPool>> = LazyLock::new(|| {
    let named = ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "answer".into());
    let told = |_| tracing::error!("an answer made a panic: please report it");
    named.start_handler(|_| give_way()).panic_handler(told).build().ok()
});

/// From now on this thread gives way to those of filters and of the network.
pub fn give_way() {
    thread_local! { static GAVE: Cell<bool> = const { Cell::new(false) } }
    if !GAVE.replace(true) {
        // Elsewhere it would be the whole process.
        #[cfg(target_os = "linux")]
        let _ = rustix::process::nice(NICENESS);
    }
}

/// Does something when there is time, by a thread that gives way; not one of those that filters share, for a filter
/// would wait until it is done.
pub fn ahead(work: impl FnOnce() + Send + 'static) {
    match &*AHEAD {
        Some(pool) => pool.spawn(work),
        None => work(),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn who_gives_way_does_so_once_and_alone() {
        let nice = || rustix::process::nice(0).unwrap();
        let before = nice();
        let aside = std::thread::spawn(move || {
            give_way();
            give_way();
            nice()
        });
        assert_eq!(aside.join().unwrap(), before + NICENESS);
        assert_eq!(nice(), before, "others stay as they were");
    }
}
