//! The report as one self-contained HTML page: the levels, the table, and the pictures of each footprint side
//! by side.

use super::report::{MANY, Picture, Report};
use super::text::{Parts, parts};
use crate::page::{Encode, Page};

/// The page.
pub fn html(report: &Report, encode: Encode<'_>) -> String {
    let rules = "figure{width:192px}figure img{width:100%}\n";
    let mut page = Page::new(&format!("{}: levels of detail", report.name), rules);
    let Parts { before, rows, after } = parts(report);
    page.paragraphs(&before);
    if let Some((titles, rows)) = rows.split_first() {
        page.table(titles, rows.iter().map(|row| (false, row.to_vec())));
    }
    page.paragraphs(&after);
    if !report.rows.is_empty() {
        shown_outputs(report, &mut page);
    }
    for row in &report.rows {
        page.heading(2, &format!("Footprint {}", row.footprint));
        let mut own = report.pictures.iter().filter(|picture| picture.footprint == row.footprint).peekable();
        if own.peek().is_none() && report.cut_short {
            page.paragraph("No pictures: the time was over (--budget).");
        }
        own.for_each(|picture| side_by_side(picture, encode, &mut page));
    }
    if let Some(source) = &report.text {
        page.heading(2, "The written shader");
        page.lines(source);
    }
    page.ended()
}

/// Names the outputs that have pictures, if others have none.
fn shown_outputs(report: &Report, page: &mut Page) {
    let has_picture = |name: &&String| report.pictures.iter().any(|picture| picture.output == **name);
    let shown: Vec<&str> = report.outputs.iter().filter(has_picture).map(String::as_str).collect();
    if !shown.is_empty() && shown.len() < report.outputs.len() {
        let (some, all) = (shown.len(), report.outputs.len());
        page.paragraph(&format!("Pictures show {some} of the {all} outputs: {}.", shown.join(", ")));
    }
}

fn side_by_side(picture: &Picture, encode: Encode<'_>, page: &mut Page) {
    let ways =
        [format!("{MANY} samples"), "original, 1 sample".to_string(), "with levels, 1 sample".to_string()];
    page.text.push_str("<div>");
    for (planes, way) in picture.images.iter().zip(ways) {
        if let Some(url) = encode(picture.size, picture.size, planes) {
            let name = format!("{}: {way}", picture.output);
            page.picture(&url, &name, &name);
        }
    }
    page.text.push_str("</div>");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::Errors;
    use crate::lod::report::Row;

    fn row(footprint: f64, ns: Option<[f64; 2]>) -> Row {
        let errors = |worst: f64| Errors { outputs: Vec::new(), worst };
        Row {
            footprint,
            width: footprint,
            original: errors(1.732),
            written: errors(0.2),
            equal_samples: 281.7,
            most: 4096,
            ns,
            cheaper: ns.map(|_| 281.7),
        }
    }

    fn report(rows: Vec<Row>, pictures: &[&str]) -> Report {
        let picture = |output: &&str| Picture {
            output: (*output).to_string(),
            footprint: 1.0,
            size: 1,
            images: [vec![vec![0.5]], vec![vec![0.5]], vec![vec![0.5]]],
        };
        Report {
            name: "a<b".into(),
            coordinate: "P".into(),
            by: crate::lod::By::Side,
            width: 0.1,
            samples: 1,
            tolerance: 0.004,
            error: 0.1,
            seed: 1,
            reference_samples: 64,
            outputs: ["a", "b", "c"].map(str::to_string).to_vec(),
            cost: 2817.0,
            why: vec!["take `--samples 4`".into()],
            text: (!rows.is_empty()).then(|| "shader".to_string()),
            rows,
            tried: 1,
            pictures: pictures.iter().map(picture).collect(),
            ..Report::default()
        }
    }

    fn page(report: &Report) -> String {
        html(report, &|_, _, _| Some("data:,".to_string()))
    }

    #[test]
    fn numbers_have_no_needless_exponents_and_pictures_have_names() {
        let page = page(&report(vec![row(1.0, Some([1234.0, 9.0]))], &["a", "b"]));
        assert!(
            page.contains("<td>170 %</td>") && page.contains("<td>280</td>") && !page.contains("e2"),
            "{page}"
        );
        assert!(page.contains("alt=\"b: with levels, 1 sample\""), "{page}");
        assert!(page.contains("<p>Pictures show 2 of the 3 outputs: a, b.</p>"), "{page}");
    }

    #[test]
    fn what_is_missing_is_said() {
        let mut report = report(vec![row(1.0, Some([5.0, 4.0])), row(4.0, None)], &[]);
        report.cut_short = true;
        let said = "The time was over (--budget) before these were measured: the errors and times at footprint 16, 64, 256; \
                    the times at footprint 4.";
        assert!(
            page(&report).contains(said) && crate::lod::text(&report).contains(said),
            "{}",
            page(&report)
        );
        assert_eq!(page(&report).matches("No pictures: the time was over").count(), 2);
    }

    #[test]
    fn a_page_without_levels_says_why() {
        let page = page(&report(Vec::new(), &[]));
        assert!(page.contains("<code>--samples 4</code>"), "{page}");
    }
}
