//! Why an effect is in a picture or not, in words: the number that decides against its threshold.

use super::small::{BLUR_PX, View};
use super::{asks, diffraction, keeps, light, tolerance};
use crate::scene::{EffectName, Scene};

/// Whether it is asked for, whether it is seen, and the number that says so.
pub(super) fn reason(view: &View<'_>, name: EffectName) -> (bool, bool, String) {
    let (scene, seen) = (view.scene, view.seen());
    let asked = asks(scene, name);
    let is_seen = !view.is_small(name);
    let count = |list: &dyn Fn(usize) -> bool| (0..seen.materials.len()).filter(|&i| list(i)).count();
    let material = |i: usize| &scene.surfaces.materials[i];
    let in_view = count(&|i| seen.materials[i]);
    let materials = |found: usize, what: &str| {
        (asked, found > 0, format!("{what} in {found} of {in_view} materials in view, threshold 1"))
    };
    // What the sun's light goes through may lie out of view.
    let choice = scene.render.effects;
    let casts = seen.triangles > 0
        && asks(scene, EffectName::Shadows)
        && !choice.without.has(EffectName::Shadows)
        && (choice.all || keeps(view, EffectName::Shadows).is_some() || !view.is_small(EffectName::Shadows));
    let casting = |has: &dyn Fn(usize) -> bool, (in_view, anywhere): (&[bool], &[bool]), what: &str| {
        let found = count(&|i| in_view[i] && has(i));
        let out_of_view = count(&|i| anywhere[i] && has(i));
        if found > 0 || !casts || out_of_view == 0 {
            return materials(found, what);
        }
        let of = count(&|i| seen.anywhere[0][i]);
        (
            asked,
            true,
            format!("{out_of_view} of {of} materials that may cast shadows have {what}, threshold 1"),
        )
    };
    let brightest = view.light();
    let by_light = |because: String| match brightest > 1.0 {
        true => format!("{because} for light up to {}", digits(brightest)),
        false => because,
    };
    match name {
        EffectName::Defocus if !asked => {
            (false, false, format!("a pinhole: largest blur 0 px, threshold {BLUR_PX} px"))
        }
        EffectName::Defocus => {
            let threshold = view.blur_threshold();
            let (blur, threshold) = (pixels_beside(view.blur(), threshold), digits(threshold));
            let tilted = match lean(scene) {
                0.0 => String::new(),
                degrees => {
                    format!("; tilted focus: its plane leans {} degrees from the film", digits(degrees))
                }
            };
            let because = by_light(format!("largest blur {blur}, threshold {threshold} px")) + &tilted;
            let because = match (view.has_falloff_over_lens(), view.has_sky_over_lens()) {
                (true, true) => because + ", and falloff and the sky show the lens",
                (true, false) => because + ", and falloff shows the lens",
                (false, true) => {
                    let threshold = view.falloff_threshold();
                    let (most, threshold) =
                        (beside(light::sky_over_lens(scene), threshold), digits(threshold));
                    format!("{because}; the sky changes by up to {most}, threshold {threshold}")
                }
                (false, false) => because,
            };
            (true, is_seen, because)
        }
        EffectName::Antialiasing => {
            (true, true, "each pixel is the mean over a square of 1 px, threshold 0 px".into())
        }
        EffectName::Textures => {
            let maps = (0..seen.textured.len()).filter(|&i| seen.textured[i]);
            let maps: Vec<_> = maps.filter_map(|i| material(i).diffuse_map.as_ref()).collect();
            let (asked, is_seen, because) = materials(maps.len(), "a map_Kd");
            let texels = maps
                .iter()
                .filter_map(|map| map.levels.first())
                .map(|level| level.width.max(level.height))
                .max();
            let filter = texels.map_or(String::new(), |texels| {
                format!(
                    "; filter: up to {texels} texels a side, levels of half as many where a pixel has over 4"
                )
            });
            (asked, is_seen, because + &filter)
        }
        EffectName::Holes => {
            let is_holed = |i: usize| material(i).holed_maps().next().is_some();
            casting(&is_holed, (&seen.textured, &seen.anywhere[1]), "a texture with alpha below 0.5")
        }
        EffectName::Coverage => {
            casting(&|i| material(i).coverage < 1.0, (&seen.materials, &seen.anywhere[0]), "d below 1")
        }
        EffectName::Shadows | EffectName::SoftShadows if scene.sun.is_none() => {
            (false, false, "no [sun] table: 0 suns, threshold 1".into())
        }
        EffectName::Shadows | EffectName::SoftShadows
            if scene.sun.as_ref().is_some_and(|sun| !sun.shadows) =>
        {
            let triangles = seen.triangles;
            (false, false, format!("sun.shadows = false; {triangles} triangles in view, threshold 1"))
        }
        EffectName::Shadows | EffectName::SoftShadows if !view.has_sunlight() => (
            asked,
            false,
            "no sunlight comes back from any material: it changes by 0, threshold above 0".into(),
        ),
        EffectName::Shadows => {
            let triangles = seen.triangles;
            let because = format!("{triangles} triangles in view, threshold 1");
            let nothing = if triangles > 0 && !is_seen {
                "; light goes 0 m through the scene to them, threshold above 0"
            } else {
                ""
            };
            (true, is_seen, because + nothing)
        }
        EffectName::SoftShadows => {
            let threshold = view.penumbra_threshold();
            let (width, threshold) = (pixels_beside(view.penumbra(), threshold), digits(threshold));
            let key = match asked {
                true if scene.render.effects.without.has(EffectName::Shadows) => "--without shadows: ",
                true => "",
                false => "sun.angular_diameter_deg = 0: ",
            };
            let degrees = scene.sun.as_ref().map_or(0.0, |sun| sun.angular_diameter.as_degrees());
            let sun = if asked { format!("a sun of {} degrees, ", digits(degrees)) } else { String::new() };
            let most = tolerance(scene);
            let grazing = match view.grazing() {
                0.0 => String::new(),
                change => {
                    let change = beside(change, most);
                    format!(
                        ", or by {change} RMS where normals turn to a sun that grazes, threshold {}",
                        digits(most)
                    )
                }
            };
            (
                asked,
                is_seen,
                format!(
                    "{key}{sun}penumbra up to {width} square to the light, threshold {threshold} px, or sunlight changes by up to {}, \
                     threshold {}{grazing}",
                    beside(light::softening(scene), view.falloff_threshold()),
                    digits(view.falloff_threshold())
                ),
            )
        }
        EffectName::ApertureShape => match scene.blades {
            None => (false, false, "no [camera.aperture] table: a disk, 0 blades, threshold 3".into()),
            Some(_) if !asked => (false, false, "a pinhole: 0 mm across has no shape".into()),
            Some(blades) => {
                // Only diffraction shows the shape of a point.
                let (count, threshold) = (blades.count, view.shape_threshold());
                let blur = pixels_beside(if view.has_lens() { view.blur() } else { 0.0 }, threshold);
                let threshold = digits(threshold);
                let key = if view.has_lens() { "" } else { "--without defocus: " };
                let because =
                    by_light(format!("{key}{count} blades, largest blur {blur}, threshold {threshold} px"));
                let shows = [
                    ("diffraction", view.has_diffraction()),
                    ("falloff", view.has_lens() && view.has_falloff_over_lens()),
                    ("the sky", view.has_lens() && view.has_sky_over_lens()),
                ];
                let names: Vec<_> = shows.iter().filter(|(_, shows)| *shows).map(|(name, _)| *name).collect();
                let because = match names.len() {
                    0 => because,
                    1 => format!("{because}, and {} shows it", names[0]),
                    _ => format!("{because}, and {} show it", names.join(" and ")),
                };
                (true, is_seen, because)
            }
        },
        EffectName::Falloff => {
            let threshold = view.falloff_threshold();
            let (most, threshold) = (beside(light::largest_falloff(scene), threshold), digits(threshold));
            let key = if asked { "light changes" } else { "render.falloff = false; light would change" };
            (asked, is_seen, format!("{key} by up to {most}, threshold {threshold}"))
        }
        EffectName::Diffraction => {
            let (_, because) = diffraction::reason(view);
            let key = if scene.render.diffraction { "" } else { "render.diffraction = false; " };
            (asked, is_seen, format!("{key}{because}"))
        }
    }
}

/// How far the plane of sharp focus leans from the film's, degrees from 0 to 90; 0 also where lens and film lean by nothing but rounding,
/// which turns a plane at infinity anyhow.
fn lean(scene: &Scene) -> f64 {
    let (focus, film) = (scene.optics.focus_plane().m, scene.optics.film_normal());
    if scene.optics.axis().cross(film).length() < 1e-6 {
        return 0.0;
    }
    libm::atan2(focus.cross(film).length(), focus.dot(film).abs()).to_degrees()
}

pub(super) fn pixels(number: f64) -> String {
    if number.is_finite() { format!("{} px", digits(number)) } else { "beyond measure".into() }
}

fn pixels_beside(number: f64, threshold: f64) -> String {
    if number.is_finite() { format!("{} px", beside(number, threshold)) } else { pixels(number) }
}

/// As many digits as it takes to see on which side of a threshold a number is: those of [`digits`], or more.
pub(super) fn beside(number: f64, threshold: f64) -> String {
    let usual = digits(number);
    if number == threshold || usual != digits(threshold) {
        return usual;
    }
    let more = |places: usize| [number, threshold].map(|number| format!("{number:.places$}"));
    let mut found = (2..=12).map(more).filter(|[number, threshold]| number != threshold);
    found.next().map_or(usual, |[number, _]| number)
}

/// Two digits after the point, or as many as a small number needs to show two; of the smallest and the largest two in all.
pub(super) fn digits(number: f64) -> String {
    match number {
        0.0 => "0".into(),
        number if !(1e-6..1e5).contains(&number) => format!("{number:.1e}"),
        number if number < 0.1 => format!("{number:.*}", (1.0 - libm::floor(libm::log10(number))) as usize),
        number => format!("{number:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_told_apart_from_its_threshold() {
        let told = |number, threshold| (beside(number, threshold), digits(threshold));
        assert_eq!(told(0.1196, 0.12), ("0.1196".into(), "0.12".into()));
        assert_eq!(told(0.119, 0.12), ("0.119".into(), "0.12".into()));
        assert_eq!(told(0.3, 0.12), ("0.30".into(), "0.12".into()));
        assert_eq!(told(0.12, 0.12), ("0.12".into(), "0.12".into()));
        assert_eq!(told(0.001_999, 0.002), ("0.001999".into(), "0.0020".into()));
        assert_eq!(pixels_beside(f64::INFINITY, 0.12), "beyond measure");
    }
}
