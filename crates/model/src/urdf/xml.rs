//! XML that may come from anywhere: what is refused before it is parsed, and typed access to what was.

use crate::error::Error;
use roxmltree::{Document, Node, ParsingOptions};

/// Largest file read, bytes.
const MAX_SIZE: usize = 64 << 20;
/// Deepest nesting of elements.
const MAX_DEPTH: usize = 256;
/// Most attributes of one element; their check for duplicates is quadratic.
const MAX_ATTRIBUTES: usize = 1000;
/// Most nodes of the tree: bounds the memory a hostile file can ask for to some 100 MB.
const MAX_NODES: u32 = 1_000_000;

/// A parsed file and the starts of its lines.
pub(super) struct Xml<'a> {
    pub(super) document: Document<'a>,
    text: &'a str,
    line_starts: Vec<usize>,
}

/// Parses what passes the guard.
pub(super) fn parse(text: &str) -> Result<Xml<'_>, Error> {
    guard(text)?;
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|e| {
        let (message, position) = (e.to_string(), e.pos());
        let message = message.split(" at ").next().unwrap_or_default();
        let (line, column) = (position.row as usize, position.col as usize);
        Error::syntax(
            line,
            column,
            format!("not well-formed XML: {message}; correct it or export it again"),
        )
    })?;
    let breaks = text.match_indices('\n').map(|(at, _)| at + 1);
    let line_starts = std::iter::once(0).chain(breaks).collect();
    Ok(Xml {
        document,
        text,
        line_starts,
    })
}

impl Xml<'_> {
    /// Line and column of a byte, from 1.
    pub(super) fn position(&self, at: usize) -> (usize, usize) {
        let line = self.line_starts.partition_point(|&start| start <= at);
        let column = 1 + self.text[self.line_starts[line - 1]..at].chars().count();
        (line, column)
    }

    /// An error at the start of an element.
    pub(super) fn refuse(&self, node: Node, place: &str, met: &str, rule: &str) -> Error {
        let (line, column) = self.position(node.range().start);
        Error::robot(place, met, rule).at(line, column)
    }

    /// The attribute, which must be there and not be empty.
    pub(super) fn required<'n>(
        &self,
        node: Node<'n, '_>,
        name: &str,
        place: &str,
    ) -> Result<&'n str, Error> {
        let missing = || {
            let met = format!("<{}> without {name}", node.tag_name().name());
            self.refuse(node, place, &met, "URDF requires this attribute: add it")
        };
        node.attribute(name)
            .filter(|v| !v.trim().is_empty())
            .ok_or_else(missing)
    }

    /// `N` finite numbers separated by blanks, `None` where the attribute is absent.
    pub(super) fn numbers<const N: usize>(
        &self,
        node: Node,
        name: &str,
        place: &str,
    ) -> Result<Option<[f64; N]>, Error> {
        let Some(attribute) = node.attribute_node(name) else {
            return Ok(None);
        };
        let value = attribute.value();
        let parsed: Option<Vec<f64>> = value
            .split_whitespace()
            .map(|word| word.parse().ok())
            .collect();
        let finite = parsed.filter(|v| v.iter().all(|x: &f64| x.is_finite()));
        if let Some(numbers) = finite.and_then(|v| <[f64; N]>::try_from(v).ok()) {
            return Ok(Some(numbers));
        }
        let (line, column) = self.position(attribute.range().start);
        let plural = if N == 1 { "" } else { "s separated by blanks" };
        let met = format!("{name}={value:?}");
        let rule = format!("it needs {N} finite number{plural}, with a decimal point");
        Err(Error::robot(place, met, rule).at(line, column))
    }

    /// One finite number, `None` where the attribute is absent.
    pub(super) fn number(&self, node: Node, name: &str, place: &str) -> Result<Option<f64>, Error> {
        Ok(self.numbers::<1>(node, name, place)?.map(|[value]| value))
    }
}

/// The first child element of this name.
pub(super) fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|n| n.has_tag_name(name))
}

/// Refuses size, document types, unexpanded xacro, nesting and floods of attributes, reading each byte once.
fn guard(text: &str) -> Result<(), Error> {
    let refuse = |at: usize, message: String| {
        let before = &text[..at];
        let line = 1 + before.matches('\n').count();
        let column = 1 + before.chars().rev().take_while(|&c| c != '\n').count();
        Err(Error::syntax(line, column, message))
    };
    if text.len() > MAX_SIZE {
        let message = format!("{} bytes; a robot file has at most {MAX_SIZE}", text.len());
        return refuse(0, message);
    }
    let (mut at, mut depth) = (0, 0_usize);
    while let Some(open) = text[at..].find('<').map(|found| at + found) {
        let rest = &text[open..];
        if let Some(end) = skipped(rest) {
            at = open + end;
            continue;
        }
        if rest
            .get(..9)
            .is_some_and(|s| s.eq_ignore_ascii_case("<!doctype"))
        {
            let reason =
                "a DOCTYPE can expand without bound and fetch files; remove it, URDF needs none";
            return refuse(open, reason.to_owned());
        }
        let tag = tag(rest);
        if tag.attributes > MAX_ATTRIBUTES {
            return refuse(
                open,
                format!("an element with more than {MAX_ATTRIBUTES} attributes is no URDF"),
            );
        }
        if tag.text.starts_with("<xacro:") || tag.holds_expression {
            let reason = "this is xacro, not URDF; expand it first: xacro robot.xacro > robot.urdf";
            return refuse(open, reason.to_owned());
        }
        match (tag.text.starts_with("</"), tag.text.ends_with("/>")) {
            (true, _) => depth = depth.saturating_sub(1),
            (false, false) => depth += 1,
            (false, true) => {}
        }
        if depth > MAX_DEPTH {
            return refuse(open, format!("elements nested deeper than {MAX_DEPTH}"));
        }
        at = open + tag.text.len();
    }
    Ok(())
}

/// Length of a comment, CDATA section or processing instruction that `rest` starts with.
fn skipped(rest: &str) -> Option<usize> {
    let pairs = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
    let (open, close) = pairs.into_iter().find(|(open, _)| rest.starts_with(open))?;
    let inside = &rest[open.len()..];
    Some(
        open.len()
            + inside
                .find(close)
                .map_or(inside.len(), |end| end + close.len()),
    )
}

struct Tag<'a> {
    /// From `<` to `>`.
    text: &'a str,
    attributes: usize,
    /// A `${..}` stands in a value.
    holds_expression: bool,
}

fn tag(rest: &str) -> Tag<'_> {
    let mut quote = None;
    let (mut attributes, mut holds_expression, mut previous) = (0, false, b' ');
    for (i, byte) in rest.bytes().enumerate() {
        match (quote, byte) {
            (Some(open), _) if byte == open => quote = None,
            (Some(_), b'{') => holds_expression |= previous == b'$',
            (None, b'"' | b'\'') => quote = Some(byte),
            (None, b'=') => attributes += 1,
            (None, b'>') => {
                let text = &rest[..=i];
                return Tag {
                    text,
                    attributes,
                    holds_expression,
                };
            }
            _ => {}
        }
        previous = byte;
    }
    Tag {
        text: rest,
        attributes,
        holds_expression,
    }
}
