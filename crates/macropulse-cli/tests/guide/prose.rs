//! Plain English: sentences that pages and comments must not have.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// Words that no statement begins with: the subject comes first.
const STARTS: [&str; 4] = ["Of", "What", "Whether", "Where"];

/// Phrases for which there is a plainer one.
const PHRASES: [&str; 5] = ["so many", "as many", "so much", "those of it", "of which"];

/// Words of the longest sentence.
const LONGEST: usize = 30;

/// The sentences of a page that break a rule, each behind what is wrong with it.
pub fn faults(text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for sentence in paragraphs(text).iter().flat_map(|paragraph| sentences(paragraph)) {
        let words = || sentence.split(' ').filter(|word| word.contains(char::is_alphanumeric));
        let (first, count) = (words().next().unwrap_or_default(), words().count());
        if count > LONGEST {
            faults.push(format!("has {count} words: {sentence}"));
        }
        if STARTS.contains(&first) && !sentence.ends_with('?') {
            faults.push(format!("begins with {first}: {sentence}"));
        }
        let small = sentence.to_lowercase();
        let plain: Vec<&str> = small.split(|sign: char| !sign.is_alphanumeric()).collect();
        let plain = format!(" {} ", plain.join(" "));
        if let Some(phrase) = PHRASES.iter().find(|phrase| plain.contains(&format!(" {phrase} "))) {
            faults.push(format!("says \"{phrase}\": {sentence}"));
        }
    }
    faults
}

/// The comments of a Rust source, without their markers. Lines with the same marker are one comment.
pub fn comments(source: &str) -> Vec<String> {
    let mut comments: Vec<String> = Vec::new();
    let mut last = "";
    for line in source.lines() {
        let line = line.trim();
        let mut markers = ["///", "//!", "//"].into_iter();
        let marker = markers.find(|marker| line.starts_with(marker)).unwrap_or_default();
        if !marker.is_empty() && marker != last {
            comments.push(String::new());
        }
        if !marker.is_empty()
            && let Some(text) = comments.last_mut()
        {
            let rest = &line[marker.len()..];
            text.push_str(rest.strip_prefix(' ').unwrap_or(rest));
            text.push('\n');
        }
        last = marker;
    }
    comments
}

/// The paragraphs, headings and items of a page. Code within a line is one word; blocks and tables are left out.
fn paragraphs(text: &str) -> Vec<String> {
    let mut paragraphs = vec![String::new()];
    let mut left_out = 0;
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        let last = paragraphs.len() - 1;
        match event {
            Event::Start(Tag::CodeBlock(_) | Tag::Table(_)) => left_out += 1,
            Event::End(TagEnd::CodeBlock | TagEnd::Table) => left_out -= 1,
            Event::Start(Tag::Paragraph | Tag::Heading { .. } | Tag::Item) => {
                paragraphs.push(String::new());
            }
            Event::Text(text) if left_out == 0 => paragraphs[last].push_str(&text),
            Event::Code(_) if left_out == 0 => paragraphs[last].push('X'),
            Event::SoftBreak | Event::HardBreak => paragraphs[last].push(' '),
            _ => {}
        }
    }
    paragraphs
}

/// The sentences of a paragraph. A colon ends one, too.
fn sentences(paragraph: &str) -> Vec<String> {
    let mut sentences = vec![String::new()];
    for word in paragraph.split_whitespace() {
        let before = sentences.last().map(String::as_str).unwrap_or_default();
        let is_over = before.trim_end_matches([')', '"']).ends_with(['.', '!', '?', ':']);
        if is_over && !word.starts_with(char::is_lowercase) {
            sentences.push(word.to_owned());
        } else if let Some(sentence) = sentences.last_mut() {
            sentence.push_str(if sentence.is_empty() { "" } else { " " });
            sentence.push_str(word);
        }
    }
    sentences
}

#[test]
fn what_is_hard_to_read_is_found() {
    let long = "word ".repeat(31);
    let page = format!(
        "# Of headings\n\nA sentence. Where it stands,\nit is found. Whether it is?\n\n\
         - What an item says\n- as many as `so many`, those of its own\n\n| of which |\n|-|\n| so many |\n\n\
         ```text\nOf code\n```\n<!-- Of comments -->\n\n{long}."
    );
    let found = faults(&page);
    let begins = ["begins with Of", "begins with Where", "begins with What", "says", "has 31"];
    assert_eq!(found.len(), begins.len(), "{found:#?}");
    for (fault, begin) in found.iter().zip(begins) {
        assert!(fault.starts_with(begin), "{fault}");
    }
}

#[test]
fn comments_are_taken_from_sources() {
    let source = "//! One.\n//! Two.\n\n/// Of three.\nfn f() {\n    // Four,\n    // five.\n    g(); // no\n}\n";
    let found = comments(source);
    assert_eq!(found, ["One.\nTwo.\n", "Of three.\n", "Four,\nfive.\n"]);
    assert_eq!(faults(&found[1]), ["begins with Of: Of three."]);
}
