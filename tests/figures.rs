//! Figure files: the book in `diagrams/` is what is drawn now, wrong files are told so with line and remedy, and the
//! program lists, writes, draws and checks them.

#[path = "common/book.rs"]
mod book;
#[path = "common/program.rs"]
mod program;

use book::book;
use groundglass::diagram::{Changes, FigureFile, Item, KINDS, PARTS, TextAs, Theme};
use groundglass::scene::{Document, Files};
use program::{folder, names, run};
use std::fs;
use std::path::Path;

#[test]
fn the_book_is_what_is_drawn_now_and_has_every_kind() {
    let mut kinds = Vec::new();
    for file in book() {
        let text = fs::read_to_string(&file).unwrap();
        let document = Document::from_bytes(text.as_bytes(), &file.display().to_string()).unwrap();
        kinds.push(FigureFile::from_document(document).unwrap().kind().name);
        let svg = FigureFile::draw_path(&file).unwrap_or_else(|error| panic!("{error}")).to_svg().unwrap();
        let found = fs::read_to_string(file.with_extension("svg")).unwrap_or_default();
        let name = file.file_name().unwrap().to_string_lossy();
        assert!(
            found == svg,
            "diagrams/{name} has another SVG: run `groundglass diagram diagrams/{name}`, and look"
        );
        assert!(!svg.contains("\n\n") && svg.contains("role=\"img\""), "{name}");
        assert!(!svg.contains("transform") && svg.len() < 60_000, "{name}: {} bytes", svg.len());
    }
    for kind in KINDS {
        assert!(kinds.contains(&kind.name), "the book has no {}", kind.name);
    }
}

#[test]
fn words_that_stay_text_are_all_there_and_turn_outside_of_the_panels() {
    fn words(items: &[Item], found: &mut Vec<String>) {
        for item in items {
            match item {
                Item::Group(group) => words(&group.items, found),
                Item::Text(text) => found.push(text.plain()),
                Item::Shape(_) | Item::Raster(_) => {}
            }
        }
    }
    for file in book() {
        let name = file.file_name().unwrap().to_string_lossy();
        let figure = FigureFile::draw_path(&file).unwrap();
        let svg = figure.to_svg_with(TextAs::Text).unwrap();
        assert!(svg.len() < 60_000, "{name}: {} bytes", svg.len());
        let tree = roxmltree::Document::parse(&svg).unwrap();
        let (mut drawn, mut wanted) = (Vec::new(), Vec::new());
        for node in tree.descendants().filter(|node| node.has_tag_name("text")) {
            let line: String = node.descendants().filter_map(|n| n.text().filter(|_| n.is_text())).collect();
            drawn.push(line);
        }
        words(&figure.display_list().items, &mut wanted);
        drawn.sort();
        wanted.sort();
        assert_eq!(drawn, wanted, "{name}");
        for node in tree.descendants().filter(|node| node.has_attribute("transform")) {
            assert!(node.ancestors().all(|n| !n.has_attribute("data-panel")), "{name}");
        }
    }
}

fn error(text: &str) -> String {
    let document = Document::from_bytes(text.as_bytes(), "figure.toml").unwrap();
    FigureFile::from_document(document).unwrap_err().to_string()
}

#[test]
fn wrong_figures_name_line_key_and_remedy() {
    let cases: &[(&str, &[&str])] = &[
        ("kind = \"side-veiw\"", &["figure.toml:1:", "kind", "did you mean \"side-view\"?"]),
        ("kind = 3", &["figure.toml:1:", "text in quotes"]),
        (
            "kind = \"side-view\"\ntitel = \"x\"",
            &["figure.toml:2:", "unknown key `titel`", "did you mean `title`?"],
        ),
        (
            "kind = \"side-view\"\nhide = [\"bellow\"]",
            &["figure.toml:2:", "hide[0]", "did you mean \"bellows\"?"],
        ),
        ("kind = \"side-view\"\nshow = [\"rays\"]", &["figure.toml:2:", "show[0]", "did you mean \"ray\"?"]),
        ("kind = \"side-view\"\ntheme = \"drak\"", &["did you mean \"dark\"?"]),
        ("kind = \"side-view\"\nwidth = \"ieee-colum\"", &["did you mean \"ieee-column\"?"]),
        ("kind = \"side-view\"\nwidth_mm = -3", &["figure.toml:2:", "width_mm", "at least 1"]),
        ("kind = \"side-view\"\ntilt_deg = 3", &["unknown key `tilt_deg`", "belongs to [camera.front]"]),
        ("kind = \"side-view\"\n[camera]\nfocal_length_mm = \"x\"", &["figure.toml:3:", "a number"]),
    ];
    for (text, words) in cases {
        let error = error(text);
        for word in *words {
            assert!(error.contains(word), "`{word}` is not in: {error}");
        }
    }
}

#[test]
fn the_program_lists_writes_draws_and_checks_figures() {
    let (_keep, folder) = folder("");
    let run = |words: &[&str]| run(&folder, words);
    let list = run(&["diagram", "--list"]);
    assert_eq!(list.code, 0);
    assert_eq!(list.out.lines().count(), KINDS.len());
    run(&["diagram", "--new", "side-vew"]).expect(64, &["did you mean \"side-view\"?"]);
    assert_eq!(run(&["diagram", "--new", "side-view"]).code, 0);
    run(&["diagram", "--new", "side-view"]).expect(2, &["side-view.toml", "already"]);
    run(&["diagram", "--new", "side-view", "-o", "a.svg"]).expect(64, &["a.svg", "ends in .toml"]);
    run(&["diagram", "scene.toml"]).expect(64, &[]);
    run(&["diagram", "--check", "side-view.toml"]).expect(1, &[]);
    assert_eq!(run(&["diagram", "side-view.toml"]).code, 0);
    assert_eq!(run(&["diagram", "--check", "side-view.toml"]).code, 0);
    // Without a name, all figures beside; other TOML is none of them.
    fs::write(folder.join("other.toml"), "a = 1\n").unwrap();
    assert_eq!(run(&["diagram", "--check"]).code, 0);
    // What is no TOML hides nothing of the others.
    fs::write(folder.join("broken.toml"), "a = \n").unwrap();
    run(&["diagram", "--check"]).expect(2, &["broken.toml"]);
    fs::remove_file(folder.join("broken.toml")).unwrap();
    // A source without a last line's end, and a name with a blank.
    let source = fs::read_to_string(folder.join("side-view.toml")).unwrap();
    fs::write(folder.join("a b.toml"), source.trim_end()).unwrap();
    assert_eq!(run(&["diagram", "--gallery", "page.md"]).code, 0);
    let page = fs::read_to_string(folder.join("page.md")).unwrap();
    assert!(page.contains("![a b](<a b.svg>)") && page.contains("![side-view](side-view.svg)"));
    assert_eq!(page.matches("\n```\n").count(), 2);
    fs::remove_file(folder.join("a b.toml")).unwrap();
    fs::create_dir(folder.join("diagrams")).unwrap();
    run(&["diagram", "--check"]).expect(64, &["no figures", "--new"]);
    fs::rename(folder.join("side-view.toml"), folder.join("diagrams/a.toml")).unwrap();
    run(&["diagram", "--check"]).expect(1, &[]);
    fs::rename(folder.join("diagrams/a.toml"), folder.join("side-view.toml")).unwrap();
    let svg = fs::read_to_string(folder.join("side-view.svg")).unwrap();
    fs::write(folder.join("side-view.svg"), svg.replace("Lens", "Film")).unwrap();
    let stale = run(&["diagram", "--check", "side-view.toml"]);
    assert_eq!(stale.code, 1);
    assert!(
        stale.out.contains("side-view.svg is stale")
            && stale.out.contains("groundglass diagram side-view.toml")
    );
    let several =
        ["diagram", "side-view.toml", "-o", "a.svg", "-o", "a.png", "--theme", "dark", "--width-mm", "84"];
    assert_eq!(run(&several).code, 0);
    let dark = fs::read_to_string(folder.join("a.svg")).unwrap();
    assert!(dark.contains("width=\"84mm\"") && !dark.contains("#ffffff"));
    run(&["diagram", "side-view.toml", "-o", "a.svg", "--theme", "drak"]).expect(64, &["contrast"]);
    run(&["diagram", "side-view.toml", "side-view.toml", "-o", "a.svg"]).expect(64, &["-o"]);
    fs::write(
        folder.join("both.toml"),
        "kind = \"side-view\"\nscene = \"s.toml\"\n[camera]\neye_m = [0, 0, 0]\n\
        look_at_m = [0, 0, 1]\nfocal_length_mm = 150\nf_number = 8\nfilm = \"4x5\"\nextension_mm = 150\n",
    )
    .unwrap();
    run(&["diagram", "both.toml"]).expect(2, &["both.toml:2:", "scene", "exclude"]);
    fs::write(folder.join("no.toml"), "kind = \"side-view\"\nscene = \"s.toml\"\n").unwrap();
    run(&["diagram", "no.toml"]).expect(2, &["no.toml:2:", "there is no file `s.toml`"]);
    // A file that cannot be drawn hides nothing of the others; nor does a letter that the font has not.
    fs::write(folder.join("side-view.svg"), "").unwrap();
    let mixed = run(&["diagram", "--check", "no.toml", "side-view.toml"]);
    mixed.expect(2, &["no.toml:2:"]);
    assert!(mixed.out.contains("side-view.svg is stale"), "{}", mixed.out);
    let plot = "kind = \"plot\" # 字\n[[series]]\nname = \"a 字\"\nx = [1, 2]\ny = [1, 2]\n";
    fs::write(folder.join("glyph.toml"), plot).unwrap();
    run(&["diagram", "glyph.toml"])
        .expect(2, &["glyph.toml:3:11", "no glyph", "use Latin, Greek or Cyrillic letters"]);
    // A kind that draws files of its reader's says so.
    let needs =
        [("figure-1", "scenes"), ("view-pair", "picture"), ("pictures", "pictures"), ("heat-map", "data")];
    for (kind, key) in needs {
        let new = run(&["diagram", "--new", kind]);
        assert!(new.code == 0 && new.out.contains(&format!("`{key}`")), "{kind}: {}", new.out);
    }
    assert!(!names(&folder).iter().any(|name| name.ends_with(".part")));
}

/// Pages without a height of their own are as high as their sentences need, however many lines a narrow page breaks them into.
#[test]
fn narrow_pages_are_as_high_as_they_need() {
    let (_keep, folder) = folder("");
    for kind in KINDS.iter().map(|kind| kind.name) {
        if ["figure-1", "view-pair", "pictures", "heat-map"].contains(&kind) {
            continue;
        }
        run(&folder, &["diagram", "--new", kind]).expect(0, &[]);
        let width = if ["perspective-correction", "plot"].contains(&kind) { "70" } else { "60" };
        let file = format!("{kind}.toml");
        let drawn = run(&folder, &["diagram", &file, "--width-mm", width, "-o", "k.svg"]);
        assert_eq!(drawn.code, 0, "{kind}: {}", drawn.err);
    }
    let text = fs::read_to_string(folder.join("hinge.toml")).unwrap();
    fs::write(folder.join("low.toml"), text.replace("kind =", "height_mm = 60.0\nkind =")).unwrap();
    run(&folder, &["diagram", "low.toml", "--width-mm", "60"])
        .expect(2, &["low.toml:", "height_mm", "at least"]);
    fs::write(folder.join("d.csv"), "x,y,v\n1,1,1\n1,2,2\n2,1,3\n2,2,\n").unwrap();
    let map = "kind = \"heat-map\"\nwidth = \"ieee-column\"\ndata = \"d.csv\"\nbands = [1.5]\n[x]\ncolumn = \"x\"\n[y]\n\
               column = \"y\"\n[[panel]]\nname = \"v\"\ncolumn = \"v\"\n";
    fs::write(folder.join("map.toml"), map).unwrap();
    run(&folder, &["diagram", "map.toml"]).expect(0, &[]);
    // What an empty cell means is told where there is one.
    let words = |name: &str| fs::read_to_string(folder.join(name)).unwrap().matches("no value").count();
    let with = words("map.svg");
    fs::write(folder.join("d.csv"), "x,y,v\n1,1,1\n1,2,2\n2,1,3\n2,2,4\n").unwrap();
    run(&folder, &["diagram", "map.toml"]).expect(0, &[]);
    assert!(words("map.svg") < with, "{with}");
}

#[test]
fn what_falls_off_the_page_is_said() {
    let (_keep, folder) = folder("");
    let plot = "kind = \"plot\"\n[x]\nmax = 2\n[[series]]\nname = \"a\"\nx = [1, 2, 3]\ny = [1, 2, 3]\n";
    fs::write(folder.join("cut.toml"), plot).unwrap();
    run(&folder, &["diagram", "cut.toml"]).expect(0, &["warning: cut.toml: points lie off the chart"]);
    fs::write(folder.join("cut.toml"), format!("{plot}[[guide]]\ny = 9\n")).unwrap();
    run(&folder, &["diagram", "cut.toml"]).expect(0, &["warning: cut.toml: guides lie off the chart"]);
    let barred = plot.replace("max = 2", "max = 3") + "error = [0.5, 0.5, 0.5]\n[y]\nmax = 3.2\n";
    fs::write(folder.join("cut.toml"), barred).unwrap();
    run(&folder, &["diagram", "cut.toml"]).expect(0, &["warning: cut.toml: error bars run off the chart"]);
    // Of points that are shown, though another is not.
    let barred = format!("{plot}error = [0.5, 0.5, 0.5]\n[y]\nmax = 2.2\n");
    fs::write(folder.join("cut.toml"), barred).unwrap();
    run(&folder, &["diagram", "cut.toml"])
        .expect(0, &["points lie off the chart", "error bars run off the chart"]);
    // One of several cameras', by what it differs in; little tilts have a page of their own scale.
    let sweep = |tilts: &str| {
        format!(
            "kind = \"tilt-sweep\"\ntilts_deg = {tilts}\n[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\n\
             focal_length_mm = 150\nf_number = 8\nfilm = \"4x5\"\nextension_mm = 150\n"
        )
    };
    for (tilts, warning, planes) in [
        ("[1, 2, 4]", "", 3),
        ("[1, 20]", "warning: sweep.toml: the focus plane at a tilt of 1° lies off the page\n", 1),
    ] {
        fs::write(folder.join("sweep.toml"), sweep(tilts)).unwrap();
        assert_eq!(run(&folder, &["diagram", "sweep.toml"]).err, warning);
        let svg = fs::read_to_string(folder.join("sweep.svg")).unwrap();
        let drawn = svg.matches("<g data-part=\"focus-plane\"");
        assert_eq!(drawn.count(), planes, "{tilts}");
    }
    // Focused at infinity, of other f-numbers than the camera's own.
    let wedge = sweep("[]")
        .replace("tilt-sweep", "wedge")
        .replace("tilts_deg = []", "f_numbers = [8, 11]")
        .replace("f_number = 8", "f_number = 1.4");
    fs::write(folder.join("wedge.toml"), wedge).unwrap();
    assert_eq!(run(&folder, &["diagram", "wedge.toml"]).err, "");
    // A line that is far off is told in the figure, by an arrow and in words.
    let far = "kind = \"hinge\"\n[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\nfocal_length_mm = 150\n\
               f_number = 8\nfilm = \"4x5\"\nextension_mm = 160\n[camera.front]\ntilt_deg = 0.01\n";
    fs::write(folder.join("far.toml"), far).unwrap();
    assert_eq!(run(&folder, &["diagram", "far.toml", "--text", "text"]).err, "");
    let svg = fs::read_to_string(folder.join("far.svg")).unwrap();
    assert!(svg.contains("data-part=\"arrow\"") && svg.contains("859 m below"), "{svg}");
    // Words for which a narrow page has no room, and their group.
    let accumulation = book().into_iter().find(|file| file.ends_with("accumulation.toml")).unwrap();
    fs::copy(accumulation, folder.join("narrow.toml")).unwrap();
    run(&folder, &["diagram", "narrow.toml", "--width-mm", "60"])
        .expect(0, &["narrow.toml: there is no room for the words \"", "give a wider page"]);
    let svg = fs::read_to_string(folder.join("narrow.svg")).unwrap();
    assert!(svg.contains("data-off-page=\"no-room\"") && svg.contains("data-words=\""), "{svg}");
    // A camera that can hardly be built is said to be one, as of a scene.
    let wide = "kind = \"side-view\"\n[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\nfocal_length_mm = 30\n\
                f_number = 8\nfilm = \"4x5\"\nextension_mm = 31\n";
    fs::write(folder.join("wide.toml"), wide).unwrap();
    run(&folder, &["diagram", "wide.toml"]).expect(0, &["warning: wide.toml: a corner of the film lies"]);
    // Nothing of the kind is said of the book.
    for file in book() {
        assert_eq!(FigureFile::draw_path(&file).unwrap().warnings(), [], "{}", file.display());
    }
}

#[test]
fn what_a_section_does_not_show_is_said() {
    let (_keep, folder) = folder("");
    let figure = |keys: &str, rest: &str| {
        let text = format!(
            "kind = {keys}\n[camera]\neye_m = [0, 1.6, 0]\nlook_at_m = [0, 1.6, -1]\nfocal_length_mm = 150\n\
             f_number = 8\nfilm = \"4x5\"\nextension_mm = 155\n{rest}"
        );
        fs::write(folder.join("a.toml"), &text).unwrap();
        let out = run(&folder, &["diagram", "a.toml", "--text", "text"]);
        (out.expect(0, &[]).err.clone(), fs::read_to_string(folder.join("a.svg")).unwrap())
    };
    // A film shifted out of the section.
    let (told, _) = figure("\"side-view\"", "[camera.front]\ntilt_deg = 5\n[camera.rear]\nshift_mm = 70\n");
    assert!(told.contains("the film lies beside this section"), "{told}");
    // A wedge thinner than any line, on the page.
    let (told, _) = figure("\"side-view\"", "[focus]\ndistance_m = 3\ncircle_of_confusion_mm = 1e-6\n");
    assert!(told.contains("the wedge is too thin to be drawn") && !told.contains("off the page"), "{told}");
    // An enlargement that is none.
    let (told, svg) = figure("\"side-view\"\ninset = \"always\"", "[focus]\ndistance_m = 0.2\n");
    assert!(told.contains("would show it no larger") && !svg.contains("data-panel=\"inset\""), "{told}");
    // A camera that looks down is drawn with its rail level, and the figure says so.
    let level = figure("\"side-view\"", "").1;
    let down = fs::read_to_string(folder.join("a.toml")).unwrap().replace("[0, 1.6, -1]", "[0, 0.6, -1]");
    fs::write(folder.join("down.toml"), down).unwrap();
    run(&folder, &["diagram", "down.toml", "--text", "text"]).expect(0, &[]);
    let down = fs::read_to_string(folder.join("down.svg")).unwrap();
    assert!(down.contains("side view, rail level") && !level.contains("rail level"));
    // Far limits beyond infinity, by the f-number.
    let (_, svg) = figure("\"wedge\"\nf_numbers = [8, 64]", "");
    let words: String = svg.split(['<', '>']).collect::<Vec<_>>().join("");
    assert!(words.contains("/64") && svg.contains("(to infinity)"), "{words}");
    let (_, svg) = figure("\"limits-compared\"", "");
    assert!(!svg.contains("here to infinity"));
    let (_, svg) = figure("\"limits-compared\"", "[focus]\ndistance_m = 100\n");
    assert!(svg.contains("here to infinity"));
}

#[test]
fn accumulation_parts_a_point_over_its_whole_blur() {
    // An aperture of 50 mm, the film at 140 mm, and the image of 560 mm at f d / (d - f).
    let camera = "[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\nfocal_length_mm = 100\n\
                  f_number = 2\nfilm = \"4x5\"\nextension_mm = 140\n";
    for points in [2, 5, 16] {
        let text = format!("kind = \"accumulation\"\npoints = {points}\nfarther = 1.6\n{camera}");
        let image = 100.0 * 560.0 / (560.0 - 100.0);
        let blur = 50.0 * (140.0 - image) / image;
        let document = Document::from_bytes(text.as_bytes(), "a.toml").unwrap();
        let file = FigureFile::from_document(document).unwrap();
        let figure = file.draw(&Files::new(), "".as_ref(), Changes::default()).unwrap();
        let said = figure.to_svg_with(TextAs::Text).unwrap();
        // Three digits.
        assert!(said.contains(&format!("over {blur:.1} mm")), "{points}: {blur} in {said}");
    }
}

#[test]
fn the_gallery_shows_the_book() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (_keep, folder) = folder("");
    for sub in ["docs", "diagrams"] {
        fs::create_dir(folder.join(sub)).unwrap();
    }
    for file in book() {
        let name = format!("diagrams/{}", file.file_name().unwrap().to_string_lossy());
        fs::copy(&file, folder.join(&name)).unwrap();
    }
    assert_eq!(run(&folder, &["diagram", "--gallery", "docs/gallery.md"]).code, 0);
    let made = fs::read_to_string(folder.join("docs/gallery.md")).unwrap();
    let found = fs::read_to_string(root.join("docs/gallery.md")).unwrap_or_default();
    let remedy = "run `groundglass diagram --gallery docs/gallery.md`";
    assert!(made == found, "docs/gallery.md is stale: {remedy}");
    let compared = fs::read_to_string(root.join("docs/figures-compared.md")).unwrap();
    for kind in KINDS {
        assert!(made.contains(&format!("`{}`: {}", kind.name, kind.line)), "{}", kind.name);
        let row = |line: &str| line.starts_with('|') && line.contains(&format!("`{}`", kind.name));
        assert!(compared.lines().any(row), "docs/figures-compared.md leaves out {}", kind.name);
    }
}

#[test]
fn every_colour_turns_on_dark_pages() {
    for file in book() {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let document = Document::from_bytes(&fs::read(&file).unwrap(), &name).unwrap();
        let changes = Changes { theme: Some(Theme::SCREEN), ..Changes::default() };
        let folder = fs::canonicalize(file.parent().unwrap()).unwrap();
        let figure = FigureFile::from_document(document).unwrap().draw(&Files::new(), &folder, changes);
        let svg = figure.unwrap().to_svg().unwrap();
        let tree = roxmltree::Document::parse(&svg).unwrap();
        // A picture does not turn, nor what is marked in it.
        let is_picture = |node: &roxmltree::Node| node.attribute("data-part") == Some("film-picture");
        for node in tree.descendants().filter(|node| !node.ancestors().any(|node| is_picture(&node))) {
            for property in ["fill", "stroke", "stop-color"] {
                let Some(color) = node.attribute(property).filter(|color| color.starts_with('#')) else {
                    continue;
                };
                assert!(
                    svg.contains(&format!("[{property}=\"{color}\"]")),
                    "{name}: {property} {color} stays"
                );
            }
        }
    }
}

#[test]
fn parts_are_drawn_and_left_out_by_name() {
    let drawn = |keys: &str| {
        let camera = "[camera]\neye_m = [0, 0, 0]\nlook_at_m = [0, 0, -1]\nfocal_length_mm = 150\nf_number = 8\n\
                      film = \"4x5\"\nextension_mm = 160\n[camera.front]\ntilt_deg = 6\n";
        let text = format!("kind = \"side-view\"\n{keys}\n{camera}");
        let document = Document::from_bytes(text.as_bytes(), "figure.toml").unwrap();
        let file = FigureFile::from_document(document).unwrap();
        file.draw(&Files::new(), "".as_ref(), Changes::default()).unwrap().to_svg().unwrap()
    };
    let has = |svg: &str, part: &str| svg.contains(&format!("data-part=\"{part}\""));
    let some = drawn("show = [\"hinge-line\", \"wedge\", \"label\"]\nhide = [\"wedge\"]");
    for part in PARTS {
        let here = ["hinge-line", "label"].contains(&part);
        assert!(has(&some, part) == here || part == "dimension" || part == "subject", "{part}");
    }
    assert!(has(&some, "film") && has(&some, "lens") && !has(&drawn("hide = [\"wedge\"]"), "wedge"));
    assert!(has(&drawn(""), "wedge") && has(&drawn(""), "ray") && has(&drawn(""), "scale-bar"));
    assert!(!has(&some, "scale-bar") && has(&some, "panel-title"));
}

#[test]
fn figure_1_draws_the_cameras_of_the_example_pictures() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let camera = |path: String| {
        let text = std::fs::read_to_string(root.join(path)).unwrap();
        let (first, last) = (text.find("[camera]").unwrap(), text.find("[[mesh]]").unwrap());
        text[first..last].to_owned()
    };
    for name in ["a", "b", "c"] {
        assert_eq!(
            camera(format!("diagrams/figure-1/{name}.toml")),
            camera(format!("examples/figure-1{name}.toml"))
        );
    }
}

/// What is told and drawn of the world goes by its own upward direction.
#[test]
fn a_world_whose_up_is_z_stands_upright() {
    let camera = |up: &str, eye: &str, at: &str| {
        format!(
            "[camera]\neye_m = {eye}\nlook_at_m = {at}\n{up}focal_length_mm = 150.0\nf_number = 16.0\nfilm = \"4x5\"\nextension_mm = 152.3\n"
        )
    };
    let worlds = [
        camera("", "[0.0, 1.6, 10.0]", "[0.0, 1.6, 0.0]"),
        camera("up = [0.0, 0.0, 1.0]\n", "[0.0, -10.0, 1.6]", "[0.0, 0.0, 1.6]"),
    ];
    let told = worlds.map(|scene| {
        let (_keep, folder) = folder(&scene);
        let optics = run(&folder, &["optics", "scene.toml"]);
        assert!(optics.out.contains("vertical"), "{}", optics.out);
        fs::write(folder.join("f.toml"), "kind = \"perspective-correction\"\nscene = \"scene.toml\"\n")
            .unwrap();
        run(&folder, &["diagram", "f.toml"]).expect(0, &[]);
        (optics.out, fs::read_to_string(folder.join("f.svg")).unwrap().len())
    });
    assert_eq!(told[0].0, told[1].0);
    assert!(told[0].1.abs_diff(told[1].1) < 200, "{} and {} bytes", told[0].1, told[1].1);
}
