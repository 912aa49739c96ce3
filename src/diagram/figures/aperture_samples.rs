//! `kind = "aperture-samples"`: the lens points of a picture. In: a camera with an aperture of any shape, how many points, of
//! which sequence. Out: the aperture to scale, seen from the film, and the points in it.

use super::file::Input;
use crate::diagram::Figure;
use crate::diagram::canvas::{Canvas, Label};
use crate::diagram::display_list::{Fill, Group, Item, PanelFrame, Point, Shape};
use crate::diagram::extent;
use crate::diagram::sheet::{self, LEADING, MARGIN, STRIP, Sheet};
use crate::diagram::theme::{self, broken, solid};
use crate::diagram::words::{length, short};
use crate::error::{Error, Result};
use crate::sampling::{ApertureShape, PointSet, sample_of};
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside page and camera.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Keys {
    /// How many points.
    #[schemars(range(min = 1, max = 4096), example = 64)]
    samples: u32,
    /// Chooses other points.
    #[schemars(example = 0)]
    seed: u64,
    /// Which sequence: that of pictures is `sobol`.
    #[schemars(extend("enum" = ["sobol", "halton", "rank-1", "random"]), example = &"sobol")]
    points: String,
}

impl Default for Keys {
    fn default() -> Self {
        Self { samples: 64, seed: 0, points: "sobol".into() }
    }
}

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let page = input.page(|width| 1.15 * width)?;
    let keys: Keys = input.keys()?;
    let subject = input.camera(false)?;
    let optics = &subject.optics;
    let radius = optics.aperture_radius();
    if radius == 0.0 {
        return Err(Error::invalid("a pinhole has one point, and nothing to show").at_key("camera.pinhole"));
    }
    let theme = page.theme;
    let mut sheet = Sheet::new(page.size, [40.0, 40.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let count = if keys.samples == 1 { "one point".to_owned() } else { format!("{} points", keys.samples) };
    let set = PointSet::ALL.into_iter().find(|set| set.name() == keys.points).unwrap_or_default();
    let shape = match subject.aperture {
        ApertureShape::Disk => String::new(),
        ApertureShape::Polygon { blades, .. } => format!(", {blades} blades"),
    };
    let sentences = [
        format!(
            "{count} of the lens, *f* = {}, *f*/{}, aperture {}{shape}, as the film sees it.",
            length(optics.focal_length()),
            short(optics.focal_length() / (2.0 * radius)),
            length(2.0 * radius)
        ),
        match set {
            PointSet::Sobol => {
                "Any power of two of them fills equal areas of the lens equally; more points continue fewer."
            }
            PointSet::Halton => "Halton's sequence, shifted by chance: more points continue fewer.",
            PointSet::Rank1 => "A rank-1 lattice, shifted by chance: more points continue fewer.",
            PointSet::Random => "Independent random points: some crowd, and gaps stay.",
        }
        .to_owned(),
    ];
    let [width, height] = page.size;
    let mut lines = Vec::new();
    for sentence in &sentences {
        lines.extend(sheet::broken(sentence, width - 2.0 * MARGIN)?);
    }
    let bottom = height - MARGIN - STRIP - LEADING * lines.len() as f64 - 1.0;
    if bottom - top < 25.0 {
        return Err(Error::invalid("the page leaves no room for the drawing").at_key("height_mm"));
    }
    let bounds = [-radius, -radius, radius, radius].map(|x| 1.15 * x);
    let panel = extent::fit(bounds, [MARGIN, top, width - MARGIN, bottom], 2.0);
    let mut canvas = Canvas::new(panel, &theme);
    let rim = radius * panel.scale;
    let glass = Fill::Flat { color: theme.glass, opacity: 0.18 };
    let edge = solid(theme.lens.line, theme::MEDIUM);
    let corners: Vec<Point> =
        subject.aperture.corners().iter().map(|[u, v]| panel.page([u * radius, v * radius])).collect();
    let lens = if corners.is_empty() {
        vec![Shape::circle(panel.origin, rim, Some(glass), Some(edge))]
    } else {
        // The circle that the corners lie on, as broad as f over the f-number.
        let circle = broken(theme.lens.line, theme::HAIR, theme::DASHED);
        canvas.part("aperture-circle", vec![Shape::circle(panel.origin, rim, None, Some(circle))]);
        vec![Shape::polyline(&corners, true, Some(glass), Some(edge))]
    };
    canvas.part("lens", lens);
    let (right, left) = ([panel.frame[2], panel.origin[1]], [panel.frame[0], panel.origin[1]]);
    let (up, down) = ([panel.origin[0], panel.frame[1]], [panel.origin[0], panel.frame[3]]);
    let hair = solid(theme.faint, theme::HAIR);
    canvas.part("lens-axes", vec![Shape::line(left, right, hair), Shape::line(down, up, hair)]);
    // Their size shrinks as they crowd, so that they do not touch on the average.
    let dot = (0.32 * rim / f64::from(keys.samples).sqrt()).clamp(0.18, 0.75);
    let dots = (0..keys.samples).map(|index| {
        let [u, v] = sample_of(set, &subject.aperture, keys.seed, 0, index).lens.map(f64::from);
        let ink = Fill::Flat { color: theme.ray.word, opacity: 1.0 };
        Shape::circle(panel.page([u * radius, v * radius]), dot, Some(ink), None)
    });
    canvas.part("lens-sample", dots.collect());
    for (words, at) in [("*u*", [right[0] - 3.0, right[1]]), ("*v*", [up[0], up[1] + 3.0])] {
        canvas.label(Label::new(words, theme.quiet, vec![at]).toward([0.7, -0.7]));
    }
    let world = optics.world_from_lens();
    let (ex, ey) = optics.lens_axes();
    let (o, u, v) = (world.origin, world.vector(ex), world.vector(ey));
    let (s, [x, y]) = (panel.scale, panel.origin);
    let group: Group = canvas.finish(PanelFrame {
        name: "main",
        section: [o.x, o.y, o.z, u.x, u.y, u.z, v.x, v.y, v.z],
        page_from_section: [s, 0.0, 0.0, -s, x, y],
    })?;
    sheet.items.push(Item::Group(group));
    sheet.strip(&panel, "aperture", false)?;
    sheet.block(&lines, [MARGIN, bottom + STRIP + 1.0])?;
    let description: Vec<String> = sentences.iter().map(|sentence| sheet::plain(sentence)).collect();
    sheet.finish("Lens points", description.join(" "))
}
