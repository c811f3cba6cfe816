//! What is set aside whatever else it may seem to say: figures of speech and orders.

use super::act::Reason;
use super::cursor::Cursor;
use super::normalise::Word;

/// Figures of speech that sound like places.
const IDIOMS: &str = "in the dumps|the point of no return|over the moon|on top of the world|under the weather|on the same page|\
    through the roof|around the bend|round the bend|out of the woods|behind the times|down the drain|across the board|\
    in hot water|up in the air|on the fence|a rock and a hard place|in the same boat|down to earth|on cloud nine|\
    in the loop|out of the loop|under the table|around the clock|on thin ice|up the creek|the end of my rope|\
    in the doghouse|by the book|over the hill|off the wall|up the wall|down the rabbit hole|the elephant in the room|\
    at a crossroads|on the ball|in the zone|in the bag|off the hook|on the house|in the pipeline|the light at the end|\
    behind closed doors|on the back burner|in the long run|in the driver's seat|between the lines|\
    beyond the pale|under the radar|in the spotlight|through thick and thin|out of the blue|\
    out to lunch|at the end of the day|at death's door|a foot in the door|in the works|\
    in seventh heaven|in the clear|in the red|in the black|on the rocks|up to here|down the tubes|\
    on the table|off the table|in the gutter|in the toilet|down the toilet|through the wringer";
/// Verbs that order something.
const ORDERS: [&str; 188] = [
    "add", "adjust", "angle", "answer", "approach", "assemble", "assist", "attach", "back", "be",
    "book", "boot", "brew", "bring", "build", "buy", "call", "cancel", "carry", "change", "charge",
    "check", "circle", "clean", "climb", "close", "collect", "come", "connect", "contact", "continue",
    "cook", "copy", "count", "cross", "cut", "deliver", "describe", "dim", "disable", "disconnect",
    "dock", "drive", "drop", "dry", "dust", "empty", "enable", "ensure", "enter", "erase", "exit",
    "explain", "explore", "face", "feed", "fetch", "fill", "find", "fix", "fold", "follow", "forget",
    "get", "give", "go", "grab", "guard", "guide", "hand", "hang", "head", "heat", "help", "hide",
    "hold", "hurry", "ignore", "increase", "inform", "inspect", "join", "keep", "knock", "lead",
    "learn", "leave", "let", "lift", "light", "listen", "load", "lock", "look", "lower", "make", "map",
    "mark", "measure", "mop", "move", "mute", "notify", "observe", "open", "order", "pack", "park",
    "pass", "pause", "photograph", "pick", "play", "plug", "position", "pour", "prepare", "press",
    "print", "pull", "push", "put", "raise", "reach", "read", "reboot", "record", "reduce", "refill",
    "release", "remember", "remind", "remove", "repair", "repeat", "replace", "report", "reset",
    "restart", "return", "ring", "rotate", "run", "save", "say", "scan", "search", "send", "serve",
    "set", "show", "shut", "sit", "slow", "speak", "spin", "start", "stay", "stop", "store",
    "straighten", "sweep", "switch", "take", "tell", "throw", "tidy", "touch", "translate", "try",
    "turn", "type", "undock", "unload", "unlock", "unplug", "use", "vacuum", "visit", "wait", "wake",
    "walk", "warm", "wash", "watch", "water", "wipe", "write",
];

/// Why a sentence is set aside, if it has the words of a figure of speech.
pub(super) fn idiom(words: &[Word]) -> Option<Reason> {
    let found = (0..words.len()).any(|i| Cursor::new(&words[i..]).sees(IDIOMS));
    found.then_some(Reason::Idiom)
}

/// Why a sentence that is not understood is set aside, if it is an order.
pub(super) fn order(words: &[Word]) -> Option<Reason> {
    let mut at = Cursor::new(words);
    if at.eat("please") {
        return Some(Reason::Command);
    }
    at.skip(
        "please|robot|can you|could you|would you|hey|ok|okay|,|now|then|do not|will you|you should|just",
    );
    ORDERS.binary_search(&at.peek(0)).is_ok().then_some(Reason::Command)
}
