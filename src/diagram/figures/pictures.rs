//! `kind = "pictures"`: pictures side by side, each with its name under it. In: PNG files and their names. Out: the pictures
//! in rows, all as wide, to be compared.

use super::file::Input;
use super::keys::PageKeys;
use super::picture::Picture;
use crate::diagram::Figure;
use crate::diagram::display_list::{Group, Item, Shape};
use crate::diagram::lettering;
use crate::diagram::sheet::{self, GUTTER, LEADING, MARGIN, Sheet};
use crate::diagram::theme::{self, solid};
use crate::error::{Error, Result};
use schemars::JsonSchema;
use serde::Deserialize;

/// What a figure file of this kind says beside the page.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub(crate) struct Keys {
    /// PNG files of 8 bits a channel, relative to this file, row by row; all of one shape.
    #[schemars(length(min = 1, max = 24), example = vec!["before.png", "after.png"])]
    pictures: Vec<String>,
    /// What each is called.
    #[schemars(length(min = 1, max = 24), example = vec!["before", "after"])]
    names: Vec<String>,
    /// How many stand beside one another; all of them by default, up to four.
    #[serde(default)]
    #[schemars(range(min = 1, max = 8), example = 2)]
    columns: Option<u32>,
    /// How much of the file all pictures together may take, in thousands of bytes: each is set as a JPEG, at most 300 pixels to
    /// the inch, and with less detail where it must.
    #[serde(default = "pictures_kb")]
    #[schemars(range(min = 2, max = 20_000), example = 120)]
    pictures_kb: u32,
}

fn pictures_kb() -> u32 {
    33
}

/// Draws the figure that a file describes.
pub(crate) fn draw(input: &Input) -> Result<Figure> {
    let keys: Keys = input.keys()?;
    if keys.names.len() != keys.pictures.len() {
        let message = format!("{} names for {} pictures", keys.names.len(), keys.pictures.len());
        return Err(Error::invalid(message).at_key("names").remedy("give each its name"));
    }
    let mut pictures = Vec::new();
    for (i, path) in keys.pictures.iter().enumerate() {
        let key = format!("pictures[{i}]");
        let (bytes, _) = input.read(&key, path)?;
        let wrong = |why: String| input.document.error(&key, format!("`{path}` {why}"));
        let picture = Picture::read(&bytes).map_err(|why| wrong(format!("is no such PNG: {why}")))?;
        pictures.push(picture);
        let shapes = [0, i].map(|i| pictures.get(i).map_or(1.0, shape));
        if (shapes[0] / shapes[1] - 1.0).abs() > 0.02 {
            return Err(wrong("has not the shape of the first".to_owned()).remedy("render them all alike"));
        }
    }
    let shape = pictures.first().map_or(1.0, shape);
    let columns = keys.columns.map_or(pictures.len().min(4), |columns| columns as usize);
    let rows = pictures.len().div_ceil(columns);
    let wide = |width: f64| (width - 2.0 * MARGIN - GUTTER * (columns - 1) as f64) / columns as f64;
    // Names of one line or two.
    let caption = |width: f64| -> Result<f64> {
        let lines = keys.names.iter().map(|name| Ok(sheet::broken(name, wide(width))?.len()));
        Ok(LEADING * lines.collect::<Result<Vec<_>>>()?.into_iter().max().unwrap_or(1) as f64 + 1.8)
    };
    let title = if input.keys::<PageKeys>()?.title.is_some() { 1.7 * theme::TITLE } else { 0.0 };
    let page = input.page(|width| {
        let each = wide(width) / shape + caption(width).unwrap_or(LEADING);
        rows as f64 * each + title + 2.0 * MARGIN + 0.5
    })?;
    let mut sheet = Sheet::new(page.size, [30.0, 20.0], &page.theme)?;
    sheet.background = page.background;
    let top = sheet.heading(page.title.as_deref())?;
    let [width, height] = page.size;
    let under = caption(width)?;
    let high = (height - top - MARGIN) / rows as f64 - under;
    // As wide as the page lets them, or as its height does.
    let across = wide(width).min(high * shape);
    if across < 8.0 {
        return Err(Error::invalid("the page leaves no room for the pictures").at_key("width_mm"));
    }
    let most = 1000 * keys.pictures_kb as usize / pictures.len();
    for (i, (picture, name)) in pictures.iter().zip(&keys.names).enumerate() {
        let left = MARGIN + (wide(width) + GUTTER) * (i % columns) as f64;
        let upper = top + (high + under) * (i / columns) as f64;
        let bounds = [left, upper, left + across, upper + across / shape];
        let [l, t, r, b] = bounds;
        let border = Shape::polyline(
            &[[l, t], [r, t], [r, b], [l, b]],
            true,
            None,
            Some(solid(page.theme.ink, theme::HAIR)),
        );
        let items = vec![Item::Raster(picture.set(bounds, most)?), Item::Shape(border)];
        sheet.push(Group::of("picture", items));
        let mut base = b + 1.1 + lettering::ASCENT * theme::LETTER;
        for line in sheet::broken(name, wide(width))? {
            let item = sheet.caption("panel-title", lettering::runs(&line), [left, base], theme::LETTER)?;
            sheet.items.push(item);
            base += LEADING;
        }
    }
    let names: Vec<String> = keys.names.iter().map(|name| sheet::plain(name)).collect();
    sheet.finish("Pictures side by side", format!("Pictures, row by row: {}.", names.join("; ")))
}

fn shape(picture: &Picture) -> f64 {
    f64::from(picture.size[0]) / f64::from(picture.size[1])
}
