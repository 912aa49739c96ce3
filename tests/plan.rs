//! What a plan leaves out cannot be seen, and what it says is what is drawn.

mod common;
#[path = "common/program.rs"]
mod program;

use common::gap;
use common::scenes::{Random, Setting, camera, scene, yard};
use glam::DVec3;
use groundglass::Exposure;
use groundglass::plan::RenderPlan;
use groundglass::render::{Execution, render};
use groundglass::scene::{EffectChoice, EffectName, Scene};
use program::{CAMERA, SMALL, folder, run};

fn at(f_number: f64, seed: u64, tilt: f64) -> Scene {
    let setting = Setting { front: [tilt, 0.0], rear: [0.0, 0.0], f_number, stretch: 1.03, rise: 0.0 };
    let camera = camera(DVec3::new(0.3, 1.2, 2.5), DVec3::new(0.0, 0.9, -3.0), 150.0, setting);
    let mut surfaces = yard(&mut Random(seed), 60);
    surfaces.find_patches();
    scene(&camera, surfaces, 96, 64)
}

fn draw(scene: &Scene) -> Exposure {
    render(scene, Execution::default()).unwrap().0
}

#[test]
fn what_is_left_out_changes_the_picture_by_no_more_than_is_stated() {
    let mut dropped = 0;
    for seed in 0..20u64 {
        // From much too small a blur to one just under the threshold.
        let mut scene = at(400.0 + 700.0 * (seed % 5) as f64, seed, (seed % 3) as f64);
        scene.render.falloff = seed % 2 == 0;
        let plan = RenderPlan::new(&scene);
        dropped += u32::from(!plan.active().has(EffectName::Defocus));
        let planned = draw(&scene);
        scene.render.effects.all = true;
        assert!(RenderPlan::new(&scene).active().has(EffectName::Defocus));
        let change = gap(&planned, &draw(&scene));
        println!("scene {seed}: {:?}, change {change:.5}", plan.active());
        assert!(change <= plan.tolerance(), "scene {seed}: {change}");
    }
    assert!(dropped >= 10, "{dropped} of 20 scenes without defocus test too little");
}

#[test]
fn a_scene_within_a_fraction_of_a_pixel_is_drawn_as_a_pinhole() {
    let sharp = at(20_000.0, 3, 0.0);
    let plan = RenderPlan::new(&sharp);
    assert!(!plan.active().has(EffectName::Defocus) && plan.active().has(EffectName::Antialiasing));
    let effect = &plan.effects()[0];
    assert!(effect.because.contains("threshold 0.25 px"), "{}", effect.because);
    let mut without = at(5.6, 3, 0.0);
    without.render.effects.without = [EffectName::Defocus].into_iter().collect();
    // The same lens centre, film and samples: whatever the aperture was.
    assert_eq!(gap(&draw(&sharp), &draw(&without)), 0.0);
    assert!(gap(&draw(&at(5.6, 3, 0.0)), &draw(&without)) > 0.003);
}

#[test]
fn each_effect_can_be_left_out() {
    let scene = at(5.6, 7, 2.0);
    let with = draw(&scene);
    for name in [EffectName::Antialiasing, EffectName::Textures, EffectName::Defocus] {
        let mut scene = at(5.6, 7, 2.0);
        scene.render.effects = EffectChoice { without: [name].into_iter().collect(), ..Default::default() };
        assert!(!RenderPlan::new(&scene).active().has(name));
        assert!(gap(&with, &draw(&scene)) > 0.002, "{name} makes no difference");
    }
}

#[test]
fn what_only_casts_shadows_into_view_is_in() {
    let (keep, folder) = folder(CAMERA);
    let mesh = "mtllib m.mtl\nv -10 -10 0\nv 10 -10 0\nv 0 20 0\nusemtl wall\nf 1 2 3\nv -40 -40 80\nv 40 -40 80\nv 0 60 80\nusemtl \
                pane\nf 4 5 6\n";
    std::fs::write(folder.join("t.obj"), mesh).unwrap();
    std::fs::write(folder.join("m.mtl"), "newmtl wall\nKd 1 1 1\nnewmtl pane\nKd 1 1 1\nd 0.5\n").unwrap();
    for (sun, is_in) in [("shadows = true\n", true), ("shadows = false\n", false)] {
        let text = format!(
            "{CAMERA}[[mesh]]\npath = \"t.obj\"\n[sun]\ntoward = [0, 0, 1]\ncolor = [1, 1, 1]\n{sun}"
        );
        std::fs::write(folder.join("scene.toml"), text).unwrap();
        let json = run(&folder, &["explain", "scene.toml", "--json"]).expect(0, &[]).json();
        let coverage =
            json["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "coverage").unwrap();
        assert_eq!(coverage["active"], is_in, "{coverage}");
        let change = coverage["change_rms"].as_f64().unwrap();
        assert_eq!(change > 0.1, is_in, "{coverage}");
    }
    drop(keep);
}

#[test]
fn explain_tells_every_effect() {
    // Focused before the triangle, which stands at the distance of the camera's own extension.
    let (_keep, folder) = folder(&format!("{CAMERA}{SMALL}").replace("152.3", "156"));
    let found = run(&folder, &["explain", "scene.toml", "--json", "--width", "800"]);
    let json = found.expect(0, &[]).json();
    let effects = json["effects"].as_array().unwrap();
    let names: Vec<_> = effects.iter().map(|e| e["effect"].as_str().unwrap()).collect();
    assert_eq!(names, EffectName::ALL.map(EffectName::name));
    assert!(effects.iter().all(|e| e["active"].is_boolean() && e["because"].is_string()));
    assert_eq!(effects[0]["active"], true);
    assert!(effects[0]["cost"].is_number() && effects[0]["change_rms"].as_f64().unwrap() > 0.0);
    let text = run(&folder, &["explain", "scene.toml"]);
    assert!(text.expect(0, &[]).out.contains("antialiasing    in"), "{}", text.out);

    run(&folder, &["render", "scene.toml", "-o", "o.png", "--without", "defocus", "--stats", "s.json"])
        .expect(0, &[]);
    let stats: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["effects"][0]["active"], false);
    assert!(stats["effects"][0]["because"].as_str().unwrap().contains("--without defocus"));
    run(&folder, &["explain", "scene.toml", "--without", "bokeh"]).expect(64, &["aperture-shape"]);
    run(&folder, &["explain", "scene.toml", "--with", "shadows"]).expect(64, &["[sun]"]);
    run(&folder, &["explain", "scene.toml", "--with", "holes", "--without", "holes"])
        .expect(64, &["--without"]);
    run(&folder, &["explain", "nothing.toml"]).expect(2, &["nothing.toml"]);
}
