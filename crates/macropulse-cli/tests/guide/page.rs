//! A page of the guide, taken apart: its fenced blocks, and its comments about figures.

/// A page.
pub struct Page {
    /// Its path from the root of the repository.
    pub name: String,
    /// Parts to be tested, in the order of the page.
    pub parts: Vec<Part>,
    /// All of it but the comments, in words with one blank between them.
    pub words: String,
    /// The rows of its tables with their lines, but for headers, and for tables with a comment
    /// `<!-- no figures: … -->` below that says what their numbers are.
    pub rows: Vec<(usize, String)>,
}

/// A part of a page that is tested.
pub enum Part {
    Block(Block),
    Figures(Held),
}

/// A fenced block.
pub struct Block {
    /// The line of its fence.
    pub line: usize,
    pub language: String,
    /// Why its commands are not run, from the fence: "```sh not run: the reason".
    pub not_run: Option<String>,
    /// The name that the reader is told to save it by: the last file name of its kind in the paragraph
    /// before.
    pub file: Option<String>,
    pub text: String,
}

/// A comment `<!-- figures … -->`: where figures of the page come from.
pub struct Held {
    /// Its line.
    pub line: usize,
    /// Its lines, without those of the comment marks.
    pub lines: Vec<String>,
}

impl Part {
    pub fn line(&self) -> usize {
        match self {
            Self::Block(block) => block.line,
            Self::Figures(held) => held.line,
        }
    }
}

/// The endings of files that readers are told to save.
const SAVED: [(&str, &str); 4] =
    [("toml", ".toml"), ("yaml", ".yaml"), ("python", ".py"), ("sh", ".sh")];

impl Page {
    /// Takes `text` apart, the page called `name`.
    ///
    /// # Errors
    /// A sentence with the place of a fence or comment that is not closed or not understood.
    pub fn of(name: &str, text: &str) -> Result<Self, String> {
        let (mut parts, mut words, mut paragraph) = (Vec::new(), Vec::new(), String::new());
        let (mut rows, mut table) = (Vec::new(), 0);
        let mut lines = text.lines().enumerate();
        while let Some((number, line)) = lines.next() {
            let place = number + 1;
            if let Some(fence) = line.strip_prefix("```") {
                let body = until(&mut lines, "```")
                    .ok_or(format!("{name}:{place}: the block is not closed"))?;
                words.extend(body.iter().copied());
                parts.push(Part::Block(
                    block(place, fence, &body, &paragraph)
                        .map_err(|why| format!("{name}:{place}: {why}"))?,
                ));
                paragraph.clear();
            } else if line.starts_with("<!--") {
                let body = if line.ends_with("-->") {
                    Vec::new()
                } else {
                    until(&mut lines, "-->")
                        .ok_or(format!("{name}:{place}: the comment is not closed"))?
                };
                if line.starts_with("<!-- no figures: ") {
                    rows.truncate(table);
                } else if line == "<!-- figures" {
                    let lines = body.iter().map(|line| (*line).to_owned()).collect();
                    parts.push(Part::Figures(Held { line: place, lines }));
                }
            } else {
                words.push(line);
                if line.starts_with("|-") {
                    rows.pop();
                    table = rows.len();
                } else if line.starts_with('|') {
                    rows.push((place, one_blank(line)));
                }
                if line.trim().is_empty() {
                    // A paragraph stays in mind over the blank line between it and a block.
                    continue;
                }
                if number > 0 && text.lines().nth(number - 1).is_some_and(|l| l.trim().is_empty()) {
                    paragraph.clear();
                }
                paragraph.push_str(line);
                paragraph.push('\n');
            }
        }
        Ok(Self { name: name.to_owned(), parts, words: one_blank(&words.join("\n")), rows })
    }

    /// Its fenced blocks.
    pub fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.parts.iter().filter_map(|part| match part {
            Part::Block(block) => Some(block),
            Part::Figures(_) => None,
        })
    }
}

/// The lines up to the next one that begins with `end`, or nothing if there is none.
fn until<'a>(
    lines: &mut impl Iterator<Item = (usize, &'a str)>,
    end: &str,
) -> Option<Vec<&'a str>> {
    let mut body = Vec::new();
    for (_, line) in lines {
        if line.starts_with(end) {
            return Some(body);
        }
        body.push(line);
    }
    None
}

fn block(line: usize, fence: &str, body: &[&str], paragraph: &str) -> Result<Block, String> {
    let (language, rest) = fence.split_once(' ').unwrap_or((fence, ""));
    let not_run = match rest.split_once("not run: ") {
        _ if rest.is_empty() => None,
        Some(("", reason)) if !reason.is_empty() => Some(reason.to_owned()),
        _ => return Err(format!("`{rest}` behind the language is not `not run: REASON`")),
    };
    let ending = SAVED.iter().find(|(of, _)| *of == language).map(|(_, ending)| ending);
    let file = ending.and_then(|ending| {
        let code = paragraph.split('`').skip(1).step_by(2);
        code.filter(|word| word.ends_with(ending) && !word.contains(['/', ' '])).last()
    });
    let mut text = body.join("\n");
    text.push('\n');
    Ok(Block { line, language: language.to_owned(), not_run, file: file.map(str::to_owned), text })
}

/// `text` with one blank, of the plain kind, wherever there are several.
pub fn one_blank(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

const PAGE: &str = "\
Save it as `make.py`
in a folder, beside `docs/examples/ticks.py`:

```python
print(1)
```

```sh not run: needs Slurm
sbatch far.sh
```

| a |
|---|
| 1 |

<!-- figures
a = cat a.json
| {a.b} |
-->
Of `a.toml`, 2\u{a0}000.

| b |
|---|
| 3 |

<!-- no figures: they are made up -->
";

#[test]
fn a_page_is_taken_apart() {
    let page = Page::of("page.md", PAGE).unwrap();
    let [Part::Block(python), Part::Block(slurm), Part::Figures(held)] = &page.parts[..] else {
        panic!("{} parts", page.parts.len());
    };
    assert_eq!((python.line, python.file.as_deref()), (4, Some("make.py")));
    assert_eq!((python.text.as_str(), &python.not_run), ("print(1)\n", &None));
    assert_eq!((slurm.file.as_deref(), slurm.not_run.as_deref()), (None, Some("needs Slurm")));
    assert_eq!(page.rows, [(14, "| 1 |".to_owned())]);
    assert_eq!(
        (held.line, &held.lines[..]),
        (16, &["a = cat a.json", "| {a.b} |"].map(String::from)[..])
    );
    let end = "sbatch far.sh | a | |---| | 1 | Of `a.toml`, 2 000. | b | |---| | 3 |";
    assert!(page.words.ends_with(end), "{}", page.words);
}

#[test]
fn what_is_not_understood_is_refused() {
    for text in ["```sh\n", "<!-- figures\n", "```sh later\n```\n", "```sh not run: \n```\n"] {
        assert!(Page::of("page.md", text).is_err(), "{text}");
    }
}
