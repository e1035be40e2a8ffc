//! Building blocks of HTML. Text from outside is escaped on entry.

use super::picture::Picture;

/// Escapes text for use between tags and in quoted attributes.
pub fn escape(text: &str) -> String {
    let entities = [
        ("&", "&amp;"),
        ("<", "&lt;"),
        (">", "&gt;"),
        ("\"", "&quot;"),
        ("'", "&#39;"),
    ];
    // `&` must be replaced first, because the other replacements add more of it.
    let replace = |text: String, (from, to): (&str, &str)| text.replace(from, to);
    entities.into_iter().fold(text.into(), replace)
}

/// An image embedded in the page. `alternative` is plain text.
pub fn image(picture: &Picture, alternative: &str) -> String {
    let [width, height] = picture.size_px;
    format!(
        "<img width=\"{width}\" height=\"{height}\" alt=\"{}\" src=\"data:image/png;base64,{}\">",
        escape(alternative),
        picture.png_base64
    )
}

/// The head of a column, and a function that gives its cell in a row as plain text; `None` leaves the cell empty.
pub type Column<T> = (&'static str, fn(&T) -> Option<String>);

/// A table with a head row. The first cell of each row is its heading.
pub fn table<'a, T: 'a>(columns: &[Column<T>], rows: impl IntoIterator<Item = &'a T>) -> String {
    let cells = |row| {
        let cells = columns.iter().map(move |(_, cell)| cell(row));
        cells.map(|cell| cell.unwrap_or_else(|| "–".into()))
    };
    let heads = columns.iter().map(|(head, _)| *head);
    table_of_cells(heads, rows.into_iter().map(cells))
}

/// The same table with cells of plain text.
pub fn table_of_cells<'h>(
    heads: impl IntoIterator<Item = &'h str>,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = String>>,
) -> String {
    let mut text = String::from("<div class=\"scroll\"><table><thead><tr>");
    for head in heads {
        text += &format!("<th>{}</th>", escape(head));
    }
    text += "</tr></thead><tbody>\n";
    for row in rows {
        text += "<tr>";
        for (index, cell) in row.into_iter().enumerate() {
            let tag = if index == 0 { "th" } else { "td" };
            text += &format!("<{tag}>{}</{tag}>", escape(&cell));
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
        let column: Column<&str> = ("a", |cell| Some((*cell).into()));
        assert!(table(&[column], [&hostile]).contains(escaped));
        let picture = Picture {
            png_base64: String::new(),
            size_px: [1, 1],
        };
        assert!(image(&picture, hostile).contains(escaped));
    }
}
