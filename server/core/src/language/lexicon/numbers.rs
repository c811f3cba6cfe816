//! Room numbers: "123", "one two three", "one hundred twenty three" and "one twenty three" are the
//! same number, and the last is how it is said.

const UNITS: [&str; 10] = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
const TEENS: [&str; 10] = [
    "ten",
    "eleven",
    "twelve",
    "thirteen",
    "fourteen",
    "fifteen",
    "sixteen",
    "seventeen",
    "eighteen",
    "nineteen",
];
const TENS: [&str; 8] = ["twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"];

/// Is it a number in digits or a number word?
pub fn is_number(word: &str) -> bool {
    digits_of(word).is_some() || matches!(word, "hundred" | "oh")
}

/// The number that a word says as a count: "two", "3", "couple"; at most 99.
pub(crate) fn counted(word: &str) -> Option<u32> {
    match word {
        "couple" => Some(2),
        _ => digits_of(word).filter(|d| d.len() < 3).and_then(|d| d.parse().ok()),
    }
}

/// The quantity said from `at` on ("twenty five", "one hundred fifty", "30", "a couple of"), and one
/// past its last word; none if no number stands there.
pub(crate) fn quantity(words: &[String], at: usize) -> Option<(f64, usize)> {
    let (digits, end) = run(words, at);
    // Digits that no length needs are not read as one.
    if end > at && digits.len() < 7 {
        return digits.parse().ok().map(|n| (n, end));
    }
    None
}

/// Rewrites every run of numbers in the spoken form.
pub(crate) fn numbers_as_spoken(words: &[String]) -> Vec<String> {
    let mut out = Vec::with_capacity(words.len());
    let mut at = 0;
    while at < words.len() {
        let (digits, end) = run(words, at);
        if end == at {
            out.push(words[at].clone());
            at += 1;
        } else {
            say(&digits, &mut out);
            at = end;
        }
    }
    out
}

/// A name with its numbers in digits: "lecture hall one twenty three" is "lecture hall 123", "ward seven a" is "ward 7a".
pub(crate) fn numbers_in_digits(name: &str) -> String {
    let words: Vec<String> = name.split(' ').map(str::to_owned).collect();
    let mut out: Vec<String> = Vec::with_capacity(words.len());
    let mut at = 0;
    while at < words.len() {
        let (digits, end) = run(&words, at);
        if end == at {
            out.push(words[at].clone());
            at += 1;
            continue;
        }
        let letter = words.get(end).filter(|w| w.len() == 1);
        out.push(digits + letter.map_or("", String::as_str));
        at = end + usize::from(letter.is_some());
    }
    out.join(" ")
}

/// Digits of the numbers from `at` on, and one past the last word used.
fn run(words: &[String], start: usize) -> (String, usize) {
    let mut digits = String::new();
    let mut at = start;
    while let Some(word) = words.get(at).map(String::as_str) {
        let after_ten = at > start && TENS.contains(&words[at - 1].as_str());
        if word == "hundred" && at > start {
            let (rest, end) = below_hundred(words, at + 1);
            digits.extend([char::from(b'0' + rest / 10), char::from(b'0' + rest % 10)]);
            at = end;
            continue;
        }
        match digits_of(word) {
            // "twenty three": the three takes the zero's place.
            Some(d) if after_ten && UNITS[1..].contains(&word) => {
                digits.pop();
                digits.push_str(&d);
            }
            Some(d) => digits.push_str(&d),
            None if at > start && matches!(word, "oh" | "o") => digits.push('0'),
            None => break,
        }
        at += 1;
    }
    (digits, at)
}

/// The number below one hundred that may follow "hundred" (0 if none does), and where it ends.
fn below_hundred(words: &[String], at: usize) -> (u8, usize) {
    let word = |i: usize| words.get(i).map_or("", String::as_str);
    let index = |list: &[&str], w: &str| list.iter().zip(0_u8..).find(|(x, _)| **x == w).map(|(_, i)| i);
    let first = if word(at) == "and" { at + 1 } else { at };
    if let Some(tens) = index(&TENS, word(first)) {
        let unit = index(&UNITS, word(first + 1)).filter(|u| *u > 0);
        return (10 * (tens + 2) + unit.unwrap_or(0), first + 1 + usize::from(unit.is_some()));
    }
    if let Some(teen) = index(&TEENS, word(first)) {
        return (10 + teen, first + 1);
    }
    match index(&UNITS, word(first)) {
        Some(unit) if unit > 0 => (unit, first + 1),
        _ => (0, at),
    }
}

fn digits_of(word: &str) -> Option<String> {
    if !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit()) {
        return Some(word.to_owned());
    }
    let index = |list: &[&str]| list.iter().position(|w| *w == word);
    index(&UNITS)
        .or_else(|| index(&TEENS).map(|i| 10 + i))
        .or_else(|| index(&TENS).map(|i| 20 + 10 * i))
        .map(|n| n.to_string())
}

/// Says digits the way room numbers are said: "one oh five", "ten fifteen", else digit by digit.
fn say(digits: &str, out: &mut Vec<String>) {
    let d: Vec<usize> = digits.bytes().map(|b| usize::from(b.saturating_sub(b'0'))).collect();
    let lead = match d.len() {
        2 | 4 if d[0] > 0 => 2,
        3 if d[0] > 0 => 1,
        _ => 0,
    };
    if lead == 0 {
        let each = d.iter().enumerate().map(|(i, &x)| if i > 0 && x == 0 { "oh" } else { UNITS[x] });
        out.extend(each.map(str::to_owned));
        return;
    }
    if lead == 1 {
        out.push(UNITS[d[0]].to_owned());
    } else {
        say_two(d[0], d[1], out);
    }
    match d[lead..] {
        [0, 0] => out.push("hundred".to_owned()),
        [a, b] => say_two(a, b, out),
        _ => {}
    }
}

fn say_two(tens: usize, unit: usize, out: &mut Vec<String>) {
    match (tens, unit) {
        (0, u) => out.extend(["oh".to_owned(), UNITS[u].to_owned()]),
        (1, u) => out.push(TEENS[u].to_owned()),
        (t, 0) => out.push(TENS[t - 2].to_owned()),
        (t, u) => out.extend([TENS[t - 2].to_owned(), UNITS[u].to_owned()]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn spoken(text: &str) -> String {
        let words: Vec<String> = text.split(' ').map(str::to_owned).collect();
        numbers_as_spoken(&words).join(" ")
    }

    #[test]
    fn numbers_are_said_as_room_numbers_are() {
        for (text, said) in [
            ("hall 123", "hall one twenty three"),
            ("one hundred and twenty three", "one twenty three"),
            ("one hundred five b", "one oh five b"),
            ("7", "seven"),
            ("42", "forty two"),
            ("100", "one hundred"),
            ("105", "one oh five"),
            ("1015", "ten fifteen"),
            ("2300", "twenty three hundred"),
            ("32 123", "three two one two three"),
            ("007", "zero oh seven"),
            ("hundred acre wood", "hundred acre wood"),
            ("oh no", "oh no"),
        ] {
            assert_eq!(spoken(text), said, "{text}");
        }
    }

    proptest! {
        #[test]
        fn said_and_heard_again_is_the_same(digits in "[0-9]{1,7}") {
            let said = spoken(&digits);
            prop_assert_eq!(spoken(&said), said.clone());
            let words: Vec<String> = said.split(' ').map(str::to_owned).collect();
            prop_assert_eq!(run(&words, 0).0, digits);
        }
    }
}
