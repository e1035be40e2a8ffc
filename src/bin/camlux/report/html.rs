//! Pieces of HTML. Text from outside is escaped where it enters.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;

/// Text as it may stand between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            _ => escaped.push(letter),
        }
    }
    escaped
}

/// An image within the page. `alternative` is plain text.
pub fn image(png: &[u8], [width, height]: [usize; 2], alternative: &str) -> String {
    format!(
        "<img width=\"{width}\" height=\"{height}\" alt=\"{}\" src=\"data:image/png;base64,{}\">",
        escape(alternative),
        BASE64.encode(png)
    )
}

/// A table with a head; cells are plain text. The first column is a heading of its row.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = String::from("<div class=\"scroll\"><table><thead><tr>");
    for cell in head {
        text += &format!("<th>{}</th>", escape(cell));
    }
    text += "</tr></thead><tbody>\n";
    for row in rows {
        text += "<tr>";
        for (column, cell) in row.iter().enumerate() {
            let tag = if column == 0 { "th" } else { "td" };
            text += &format!("<{tag}>{}</{tag}>", escape(cell));
        }
        text += "</tr>\n";
    }
    text += "</tbody></table></div>\n";
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_a_text_becomes_markup() {
        let hostile = "<script>\"a\" & 'b'</script>";
        let escaped = "&lt;script&gt;&quot;a&quot; &amp; &#39;b&#39;&lt;/script&gt;";
        assert_eq!(escape(hostile), escaped);
        assert!(table(&["a"], &[vec![hostile.into()]]).contains(escaped));
        assert!(image(&[], [1, 1], hostile).contains(escaped));
    }
}
