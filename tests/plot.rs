//! Charts read back by their data attributes: what is drawn lies on the values; names touch nothing; wrong tables and
//! axes are told with line and remedy.

use groundglass::diagram::{Changes, Figure, FigureFile, Geometry, Item, Segment, THEMES};
use groundglass::scene::{Document, Memory};
use std::time::Instant;

const CSV: &str = "n,rms,sigma,who\n16,0.06,0.004,a\n64,0.03,0.002,a\n256,0.015,0.001,a\n16,0.02,,b\n64,0.007,,b\n256,0.002,,b\n";
const LOG: &str = r#"kind = "plot"
title = "Title"
data = "t.csv"
[x]
scale = "log"
title = "samples *N*"
[y]
scale = "log"
title = "error"
unit = "m"
[[series]]
name = "first"
x_column = "n"
y_column = "rms"
error_column = "sigma"
only_column = "who"
only = "a"
[[series]]
name = "second"
x_column = "n"
y_column = "rms"
only_column = "who"
only = "b"
[[guide]]
name = "*N^{−1/2}*"
slope = -0.5
through = [16, 0.1]
"#;

fn draw(text: &str, changes: Changes) -> groundglass::Result<Figure> {
    let source = Memory::new().with("t.csv", CSV.as_bytes()).with(
        "t.json",
        br#"{"runs": [{"n": 1, "t": 3.5}, {"n": 2, "t": -2.0}, {"n": 4, "t": 1e-3}]}"#.as_slice(),
    );
    let document = Document::from_bytes(text.as_bytes(), "plot.toml")?;
    FigureFile::from_document(document)?.draw(&source, "".as_ref(), changes)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|t| t.parse().unwrap()).collect()
}

/// The map of an axis from its attribute.
fn axis(text: &str) -> impl Fn(f64) -> f64 {
    let (scale, rest) = text.split_once(' ').unwrap();
    let (ab, is_log) = (numbers(rest), scale == "log");
    move |value| ab[0] + ab[1] * if is_log { libm::log10(value) } else { value }
}

/// Checks that every marker and every corner of every line of a chart stands on its value; gives the series' sizes.
fn check(svg: &str) -> Vec<usize> {
    let tree = roxmltree::Document::parse(svg).unwrap();
    let part = |name: &'static str| move |n: &roxmltree::Node| n.attribute("data-part") == Some(name);
    let chart = tree.descendants().find(part("chart")).unwrap();
    let (x, y) = (axis(chart.attribute("data-x").unwrap()), axis(chart.attribute("data-y").unwrap()));
    let mut sizes = Vec::new();
    for series in chart.children().filter(part("series")) {
        let values = numbers(series.attribute("data-x").unwrap());
        let values: Vec<_> = values.into_iter().zip(numbers(series.attribute("data-y").unwrap())).collect();
        let pages: Vec<[f64; 2]> = values.iter().map(|&(u, v)| [x(u), y(v)]).collect();
        let close = |p: [f64; 2], q: [f64; 2]| libm::hypot(p[0] - q[0], p[1] - q[1]) < 0.002;
        let (line, markers) = (series.children().find(part("line")), series.children().find(part("marker")));
        assert!(line.is_some() || markers.is_some(), "a series without line and markers");
        if let Some(line) = line {
            let d = line.first_element_child().unwrap().attribute("d").unwrap().replace(['M', 'L'], " ");
            let corners: Vec<[f64; 2]> = numbers(&d).chunks(2).map(|c| [c[0], c[1]]).collect();
            for page in &pages {
                assert!(corners.iter().any(|c| close(*c, *page)), "no corner at {page:?}");
            }
        }
        if let Some(markers) = markers {
            let marks: Vec<_> = markers.children().filter(|n| n.is_element()).collect();
            assert_eq!(marks.len(), pages.len());
            for (mark, page) in marks.iter().zip(&pages) {
                let center = match mark.tag_name().name() {
                    "circle" => ["cx", "cy"].map(|a| mark.attribute(a).unwrap().parse().unwrap()),
                    _ => {
                        let d = mark.attribute("d").unwrap().replace(['M', 'L', 'Z'], " ");
                        let c = numbers(&d);
                        let n = c.len() as f64 / 2.0;
                        [0, 1].map(|k| c.iter().skip(k).step_by(2).sum::<f64>() / n)
                    }
                };
                assert!(close(center, *page), "{center:?} is not {page:?}");
            }
        }
        if let Some(bars) = series.children().find(part("error-bar")) {
            assert!(bars.children().filter(|n| n.has_tag_name("line")).count() >= values.len());
        }
        sizes.push(values.len());
    }
    sizes
}

#[test]
fn drawn_points_stand_on_their_values() {
    let svg = draw(LOG, Changes::default()).unwrap().to_svg().unwrap();
    assert_eq!(check(&svg), [3, 3]);
    // Bars end at what is added and taken away.
    let tree = roxmltree::Document::parse(&svg).unwrap();
    let part = |name: &'static str| move |n: &roxmltree::Node| n.attribute("data-part") == Some(name);
    let chart = tree.descendants().find(part("chart")).unwrap();
    let (x, y) = (axis(chart.attribute("data-x").unwrap()), axis(chart.attribute("data-y").unwrap()));
    let bars = chart.descendants().find(part("error-bar")).unwrap();
    for (n, rms, sigma) in [(16.0, 0.06, 0.004), (64.0, 0.03, 0.002), (256.0, 0.015, 0.001)] {
        let ends = [x(n), y(rms - sigma), x(n), y(rms + sigma)];
        let is_bar = |line: roxmltree::Node| {
            let at = |key: &str| line.attribute(key).and_then(|at| at.parse().ok()).unwrap_or(f64::NAN);
            let found = [at("x1"), at("y1").max(at("y2")), at("x2"), at("y1").min(at("y2"))];
            found.iter().zip(ends).all(|(found, end)| (found - end).abs() < 0.002)
        };
        assert!(bars.descendants().any(is_bar), "no bar from {} to {} at {n}", rms - sigma, rms + sigma);
    }
    let linear = "kind = \"plot\"\ndata = \"t.json\"\ntable = \"/runs\"\n[[series]]\nname = \"t\"\nx_column = \"n\"\ny_column = \"t\"\n";
    assert_eq!(check(&draw(linear, Changes::default()).unwrap().to_svg().unwrap()), [3]);
    // A given end cuts off what lies beyond.
    let cut = linear.replace("[[series]]", "[x]\nmax = 3\n[[series]]");
    assert_eq!(check(&draw(&cut, Changes::default()).unwrap().to_svg().unwrap()), [2]);
}

/// The boxes of all words of a figure.
fn boxes(items: &[Item], found: &mut Vec<(String, [f64; 4])>) {
    for item in items {
        match item {
            Item::Group(group) => boxes(&group.items, found),
            Item::Text(text) => found.push((text.plain(), text.bounds)),
            Item::Shape(_) | Item::Raster(_) => {}
        }
    }
}

/// The straight pieces and markers of series.
fn strokes(items: &[Item], inside: bool, found: &mut Vec<([f64; 2], [f64; 2])>) {
    for item in items {
        match item {
            Item::Group(group) => strokes(&group.items, inside || group.part == Some("series"), found),
            Item::Shape(shape) if inside => match &shape.geometry {
                Geometry::Line(a, b) => found.push((*a, *b)),
                Geometry::Circle { center, .. } => found.push((*center, *center)),
                Geometry::Path(path) => {
                    let at = |s: &Segment| match s {
                        Segment::Move(p) | Segment::Line(p) => Some(*p),
                        _ => None,
                    };
                    let points: Vec<_> = path.iter().filter_map(at).collect();
                    found.extend(points.windows(2).map(|w| (w[0], w[1])));
                }
            },
            _ => {}
        }
    }
}

fn check_names(figure: &Figure, what: &str) {
    let list = figure.display_list();
    let (mut words, mut lines) = (Vec::new(), Vec::new());
    boxes(&list.items, &mut words);
    strokes(&list.items, false, &mut lines);
    for (i, (said, b)) in words.iter().enumerate() {
        assert!(
            b[0] >= 0.0 && b[2] <= list.page[0] && b[1] >= 0.0 && b[3] <= list.page[1],
            "{what}: {said} leaves the page"
        );
        for (other, o) in &words[..i] {
            let apart = b[2] <= o[0] || o[2] <= b[0] || b[3] <= o[1] || o[3] <= b[1];
            assert!(apart, "{what}: `{said}` touches `{other}`");
        }
        for (p, q) in &lines {
            for k in 0..=100 {
                let t = f64::from(k) / 100.0;
                let c = [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])];
                let inside = c[0] > b[0] && c[0] < b[2] && c[1] > b[1] && c[1] < b[3];
                assert!(!inside, "{what}: `{said}` touches a line");
            }
        }
    }
}

#[test]
fn names_touch_nothing_at_any_size_and_number() {
    for names in ["auto", "ends", "legend"] {
        for count in [1, 2, 5, 9] {
            for width in [85.0, 120.0, 170.0] {
                for shape in 0..4 {
                    let mut text = format!("kind = \"plot\"\nnames = \"{names}\"\n[y]\ntitle = \"y\"\n");
                    for i in 0..count {
                        let y: Vec<String> = (0..6)
                            .map(|k| {
                                let (i, k) = (f64::from(i), f64::from(k));
                                let v = match shape {
                                    0 => i * 0.01 + k,
                                    1 => (i + 1.0) / (k + 1.0),
                                    2 => libm::sin(i * 1.7 + k * 2.3),
                                    _ => k * k * (i - 3.0),
                                };
                                format!("{v:.5}")
                            })
                            .collect();
                        text += &format!(
                            "[[series]]\nname = \"series {i}\"\nx = [0, 1, 2, 3, 4, 5]\ny = [{}]\n",
                            y.join(", ")
                        );
                    }
                    let changes = Changes { width_mm: Some(width), ..Changes::default() };
                    match draw(&text, changes) {
                        Ok(figure) => {
                            check_names(&figure, &format!("{names} {count} {width} {shape}"));
                            check(&figure.to_svg().unwrap());
                        }
                        Err(error) => panic!("{names} {count} {width} {shape}: {error}"),
                    }
                }
            }
        }
    }
    check_names(&draw(LOG, Changes::default()).unwrap(), "log");
}

/// A chart of these points, with what else its file says.
fn of_points(x: &str, y: &str, more: &str) -> groundglass::Result<Figure> {
    let text = format!("kind = \"plot\"\n{more}\n[[series]]\nname = \"a\"\nx = [{x}]\ny = [{y}]\n");
    draw(&text, Changes::default())
}

#[test]
fn values_that_hardly_differ_are_all_drawn() {
    for (x, y) in [
        ("1, 2, 3", "1013.2501, 1013.2502, 1013.2507"),
        ("1, 1.0000000001, 1.0000000003", "100, 100.000000002, 100.000000005"),
        ("299792.4, 299792.5, 299792.7", "50000.01, 50000.02, 50000.03"),
        ("2461000.00001, 2461000.00002, 2461000.00003", "-0.5, -0.50001, -0.50002"),
    ] {
        let figure = of_points(x, y, "").unwrap();
        assert!(figure.warnings().is_empty(), "{x}: {:?}", figure.warnings());
        assert!(figure.to_svg().unwrap().contains(&format!("data-x=\"{}\"", x.replace(',', ""))), "{x}");
        check_names(&figure, x);
    }
    let figure = of_points("1013.2501, 1013.2507", "1, 2", "").unwrap().to_svg().unwrap();
    assert!(figure.contains("x runs from 1013.2501 to 1013.2507"), "{figure}");
}

#[test]
fn long_labels_of_axes_stay_on_the_page() {
    for width in [85.0, 160.0] {
        for (x, scale) in [
            ("1e-12, 5e-12", "linear"),
            ("1000.1, 1000.101, 1000.109", "linear"),
            ("1e12, 1000000000300", "linear"),
            ("2461000.1, 2461000.5, 2461000.9", "linear"),
            ("1, 1e13", "log"),
            ("1.2, 1.8", "log"),
        ] {
            let y = vec!["1"; x.split(',').count()].join(", ");
            let figure = of_points(x, &y, &format!("width_mm = {width}\n[x]\nscale = \"{scale}\"")).unwrap();
            check_names(&figure, &format!("{x} at {width} mm"));
        }
    }
    let ticks =
        of_points("0, 100", "0, 100", "[x]\nticks = [100, 50, 0]\n[y]\nticks = [100, 1, 2, 3, 50]").unwrap();
    check_names(&ticks, "given ticks");
    let mut words = Vec::new();
    boxes(&ticks.display_list().items, &mut words);
    assert_eq!(words.iter().filter(|(said, _)| said == "50").count(), 2, "{words:?}");
}

#[test]
fn names_that_have_no_room_are_told_with_the_height_they_need() {
    for names in ["auto", "ends", "legend"] {
        let mut text = format!("kind = \"plot\"\nnames = \"{names}\"\n");
        for i in 0..30 {
            text += &format!("[[series]]\nname = \"series {i}\"\nx = [0, 1]\ny = [0, {i}]\n");
        }
        let error = draw(&text, Changes::default()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("30 names have no room") && error.contains("height_mm"), "{error}");
        let height = error.split("a height of ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
        let figure = draw(&text.replacen('\n', &format!("\nheight_mm = {height}\n"), 1), Changes::default());
        check_names(&figure.unwrap(), names);
    }
}

fn map(rows: &str) -> groundglass::Result<Figure> {
    let source = Memory::new().with("t.csv", format!("x,y,z\n{rows}").into_bytes());
    let text = "kind = \"heat-map\"\ndata = \"t.csv\"\nbands = [1.0, 2.0]\n[x]\ncolumn = \"x\"\n[y]\ncolumn = \"y\"\n\
                [[panel]]\nname = \"one\"\ncolumn = \"z\"\n[[panel]]\nname = \"two\"\ncolumn = \"z\"\n";
    let document = Document::from_bytes(text.as_bytes(), "map.toml")?;
    FigureFile::from_document(document)?.draw(&source, "".as_ref(), Changes::default())
}

#[test]
fn maps_have_a_row_for_each_cell_and_labels_apart() {
    let svg = map("0,0,1\n-0,1,2\n1,0,3\n1,1,2.5\n").unwrap().to_svg().unwrap();
    assert!(svg.contains("in 0 of 4 cells"), "zero has no sign");
    for (rows, said) in [
        ("0,0,1\n0,1,2\n1,0,3\n1,1,2.5\n1,1,2\n", "line 5 and line 6 both have x = 1, y = 1"),
        (
            "0.3,0,1\n0.3,1,2\n0.30000000000000004,0,3\n1,0,1\n1,1,2\n",
            "no row has x = 0.30000000000000004, y = 1",
        ),
        ("0,0,one\n0,1,2\n1,0,3\n1,1,2\n", "`one` in the column `z`, line 2 of t.csv, is not a number"),
        ("0,0,1\n,1,2\n1,0,3\n1,1,2\n", "the column `x` is empty in line 3"),
    ] {
        let error = map(rows).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    check_names(&map("100000,0,1\n300000,0,2\n100000,1,1\n300000,1,2\n").unwrap(), "wide labels");
}

/// A cell is of the colour that the legend gives to its band: what is painted last over its middle.
#[test]
fn cells_have_the_colours_of_their_bands() {
    let svg = map("0,0,0.5\n1,0,1.5\n0,1,3\n1,1,\n").unwrap().to_svg().unwrap();
    let tree = roxmltree::Document::parse(&svg).unwrap();
    let part = |name: &'static str| move |n: &roxmltree::Node| n.attribute("data-part") == Some(name);
    let legend = tree.descendants().find(part("legend")).unwrap();
    let samples = legend.children().filter_map(|n| n.attribute("fill")).collect::<Vec<_>>();
    assert_eq!(samples.len(), 4, "three bands and what is empty: {samples:?}");
    let charts: Vec<_> = tree.descendants().filter(part("chart")).collect();
    assert_eq!(charts.len(), 2);
    for chart in charts {
        let (x, y) = (axis(chart.attribute("data-x").unwrap()), axis(chart.attribute("data-y").unwrap()));
        let cells = chart.children().find(part("cells")).unwrap();
        for ((u, v), color) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].into_iter().zip(&samples) {
            let (u, v) = (x(u), y(v));
            let covers = |path: &roxmltree::Node| {
                let parts =
                    path.attribute("d").unwrap_or_default().split('Z').filter(|part| !part.is_empty());
                parts.map(|part| numbers(&part.replace(['M', 'L'], " "))).any(|c| {
                    let range = |k: usize| c.iter().skip(k).step_by(2).copied();
                    let within = |k: usize, at: f64| {
                        range(k).fold(f64::INFINITY, f64::min) < at
                            && at < range(k).fold(f64::NEG_INFINITY, f64::max)
                    };
                    within(0, u) && within(1, v)
                })
            };
            let shown = cells.children().rfind(covers).and_then(|path| path.attribute("fill"));
            assert_eq!(shown, Some(*color), "at {u}, {v}");
        }
    }
}

#[test]
fn a_chart_has_its_bytes_its_themes_and_its_time() {
    let first = draw(LOG, Changes::default()).unwrap().to_svg().unwrap();
    assert_eq!(first, draw(LOG, Changes::default()).unwrap().to_svg().unwrap());
    assert!(
        first.contains("error against samples N")
            && first.contains("first: 3 points from (16, 0.06) to (256, 0.015)")
    );
    for (name, _, theme) in THEMES {
        let figure = draw(LOG, Changes { theme: Some(theme), ..Changes::default() }).unwrap();
        let svg = figure.to_svg().unwrap();
        check(&svg);
        assert!(svg.len() < 60_000 && !svg.contains("\n\n"));
        assert_eq!(svg.contains("prefers-color-scheme:dark"), name == "screen");
        assert_eq!(svg.contains("currentColor"), name == "text");
        if name == "grey" {
            // Links to letters begin with a hash mark too.
            let found = svg.match_indices("\"#").filter(|&(at, _)| !svg[..at].ends_with("href="));
            let colours = found.map(|(at, _)| &svg[at + 2..at + 8]);
            assert!(
                colours.clone().all(|c| c[0..2] == c[2..4] && c[2..4] == c[4..6]),
                "{:?}",
                colours.collect::<Vec<_>>()
            );
        }
    }
    let begun = Instant::now();
    draw(LOG, Changes::default()).unwrap().to_svg().unwrap();
    println!("{:?}", begun.elapsed());
    assert!(cfg!(debug_assertions) || begun.elapsed().as_millis() < 20);
}

/// Level error bars end at their values, with a cap at each; labels of points are in the figure, clear of all else.
#[test]
fn level_bars_and_labels_of_points() {
    let text = "kind = \"plot\"\n[x]\nscale = \"log\"\n[[series]]\nname = \"a\"\nline = false\nx = [10, 100, 1000]\n\
                y = [1.2, 2, 2.5]\nx_low = [8, 90, 0]\nx_high = [20, 110, 3000]\nlabels = [\"one\", \"\", \"three\"]\n";
    let figure = draw(text, Changes::default()).unwrap();
    check_names(&figure, "labels");
    let svg = figure.to_svg().unwrap();
    assert_eq!(check(&svg), [3]);
    let tree = roxmltree::Document::parse(&svg).unwrap();
    let part = |name: &'static str| move |n: &roxmltree::Node| n.attribute("data-part") == Some(name);
    let x = axis(tree.descendants().find(part("chart")).unwrap().attribute("data-x").unwrap());
    let bars = tree.descendants().find(part("error-bar")).unwrap();
    let ends = |n: roxmltree::Node| {
        ["x1", "y1", "x2", "y2"].map(|a| n.attribute(a).unwrap().parse::<f64>().unwrap())
    };
    let lines: Vec<_> = bars.children().filter(|n| n.has_tag_name("line")).map(ends).collect();
    let level: Vec<_> = lines.iter().filter(|l| l[1] == l[3]).collect();
    assert_eq!((level.len(), lines.len()), (3, 8), "three bars, five caps: one leaves the axis");
    assert!((level[0][0] - x(8.0)).abs() < 0.002 && (level[0][2] - x(20.0)).abs() < 0.002);
    let mut words = Vec::new();
    boxes(&figure.display_list().items, &mut words);
    assert!(["one", "three"].iter().all(|label| words.iter().any(|(said, _)| said == label)), "{words:?}");
    for (wrong, said) in [
        ("labels = [\"one\"]", "`labels` has 1 texts and `x` has 3"),
        ("labels_column = \"t\"", "there is no table"),
        ("low = [2, 2, 2]\nhigh = [1, 3, 3]", "bar runs from 2 down to 1"),
        ("error = [-1, 1, 1]", "bar runs from 2 down to 0"),
        ("low = [2, 2, 2]\nhigh = [3, 3, 3]", "(1, 1) lies beyond its bar from 2 to 3"),
        ("[x]\nmax = 3\nticks = [1, 5]", "x.ticks: the tick 5 lies off the axis, which runs from 1 to 3"),
        ("[y]\nscale = \"log\"\nticks = [0, 1]", "y.ticks: the tick 0 lies off the axis"),
        ("x_low = [1]", "`x_low` has 1 values and `x` has 3"),
        (
            "labels = [\"\\u0007\", \"\", \"\"]",
            "plot.toml:6:10: series[0].labels: the diagrams' font has no glyph",
        ),
    ] {
        let text =
            format!("kind = \"plot\"\n[[series]]\nname = \"a\"\nx = [1, 2, 3]\ny = [1, 2, 3]\n{wrong}\n");
        let error = draw(&text, Changes::default()).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn wrong_charts_name_line_key_and_remedy() {
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "y_column = \"rms\"\nerror",
            "y_column = \"rsm\"\nerror",
            &["plot.toml:", "no column `rsm`", "did you mean \"rms\"?"],
        ),
        ("only = \"a\"", "only = \"c\"", &["no row has `c`"]),
        (
            "y_column = \"rms\"\nerror",
            "y_column = \"who\"\nerror",
            &["`a` in the column `who`, line 2 of t.csv, is not a number"],
        ),
        ("data = \"t.csv\"", "data = \"u.csv\"", &["plot.toml:3:", "there is no file `u.csv`"]),
        ("data = \"t.csv\"", "", &["there is no table"]),
        ("scale = \"log\"\ntitle = \"s", "scale = \"lgo\"\ntitle = \"s", &["did you mean \"log\"?"]),
        ("slope = -0.5", "", &["guide[0]", "slope"]),
        ("unit = \"m\"", "unit = \"m\"\nmin = -1", &["-1 cannot stand on a logarithmic axis"]),
        ("only_column = \"who\"\nonly = \"b\"", "x = [1]", &["`x` and `x_column` exclude each other"]),
        ("[[guide]]", "[guides]", &["unknown key `guides`", "did you mean `guide`?"]),
        ("title = \"Title\"", "title = \"\u{4e2d}\"", &["no glyph"]),
    ];
    for (from, to, words) in cases {
        let text = LOG.replacen(from, to, 1);
        assert_ne!(text, LOG, "{from}");
        let error = draw(&text, Changes::default()).map(|_| ()).unwrap_err().to_string();
        for word in *words {
            assert!(error.contains(word), "`{word}` is not in: {error}");
        }
    }
    let series = "kind = \"plot\"\n[[series]]\nname = \"a\"\n";
    for (more, word) in [
        ("x = [1, 2]\ny = [1]\n", "`y` has 1 values and `x` has 2"),
        ("x = [1, 2]\n", "the series has no `y`"),
        ("x = [1, nan]\ny = [1, 2]\n", "finite"),
    ] {
        let error = draw(&format!("{series}{more}"), Changes::default()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    // Drawn or refused, and no panic.
    for more in ["x = [1]\ny = [1e308]\n", "x = [-1e308, 1e308]\ny = [1, 2]\n", "x = [1, 1]\ny = [5, 5]\n"] {
        let _ = draw(&format!("{series}{more}"), Changes::default());
    }
    assert!(draw("kind = \"plot\"\n", Changes::default()).is_err());
}

#[test]
fn labels_are_as_they_are_written_and_points_at_one_place_are_seen() {
    let text = "kind = \"plot\"\ndata = \"ids.csv\"\n[x]\nmin = 0\nmax = 9\n[y]\nmin = 0\nmax = 9\n[[series]]\nname = \"a\"\n\
                x_column = \"n\"\ny_column = \"n\"\nlabels_column = \"id\"\n";
    let source = Memory::new().with("ids.csv", "n,id\n5,007\n5,\n".as_bytes());
    let document = Document::from_bytes(text.as_bytes(), "plot.toml").unwrap();
    let figure = FigureFile::from_document(document).unwrap();
    let svg = figure.draw(&source, "".as_ref(), Changes::default()).unwrap().to_svg().unwrap();
    let tree = roxmltree::Document::parse(&svg).unwrap();
    assert!(svg.contains("007"), "{svg}");
    assert!(tree.descendants().any(|n| n.attribute("data-part") == Some("marker")), "{svg}");
}
