//! The asset loader on meshes held in memory: defaults, names, warnings and where they point, digests.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use glam::DVec2;
use groundglass::error::{Error, ErrorKind, Result, Warning};
use groundglass::scene::{
    AssetLoader, LoadSettings, Memory, Model, Progress, Scene, SceneDescription, Source, parse,
};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";

fn png(texel: [u8; 4]) -> Vec<u8> {
    square_png(2, texel)
}

fn square_png(side: u32, texel: [u8; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_pixel(side, side, image::Rgba(texel));
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG");
    bytes.into_inner()
}

fn load(files: &Memory, name: &str) -> Result<(Arc<Model>, Vec<String>)> {
    let mut loader = AssetLoader::new(files, Path::new("scene"));
    let model = loader.load_obj(name)?;
    Ok((model, said(loader.warnings())))
}

fn said(warnings: &[Warning]) -> Vec<String> {
    warnings.iter().map(ToString::to_string).collect()
}

fn text(text: impl Into<String>) -> Vec<u8> {
    text.into().into_bytes()
}

#[test]
fn defaults_are_those_of_the_contract() -> Result<()> {
    let obj = format!(
        "{TRIANGLE}mtllib a.mtl\nusemtl bare\nf 1 2 3\nusemtl mapped\nf 1 2 3\nusemtl broken\nf 1 2 3\n"
    );
    let mtl = "newmtl bare\nKe 1 2 3\nnewmtl mapped\nmap_Kd t.png\nd 0.5\nnewmtl broken\nmap_Kd none.png\nnewmtl x\n";
    let files = Memory::new()
        .with("scene/a.obj", text(obj))
        .with("scene/a.mtl", text(mtl))
        .with("scene/t.png", png([255, 255, 255, 0]));
    let (model, warnings) = load(&files, "a.obj")?;
    let [bare, mapped, broken, default] = &model.materials[..] else { panic!("four materials") };
    assert_eq!((bare.diffuse, bare.emission, bare.coverage), ([0.8; 3], [1.0, 2.0, 3.0], 1.0));
    assert_eq!((mapped.diffuse, mapped.coverage), ([1.0; 3], 0.5));
    assert!(mapped.diffuse_map.as_ref().is_some_and(|map| map.has_holes && map.levels.len() == 2));
    assert!(broken.diffuse == [0.8; 3] && broken.diffuse_map.is_none());
    assert!(default.diffuse == [0.8; 3] && default.name.is_empty());
    assert_eq!((model.named_materials, model.textures), (3, 1));
    assert_eq!(model.triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [3, 0, 1, 2]);
    let untextured = "a.obj:10: a face has no texture coordinates; its material's texture is not seen";
    let missing = "a.mtl:7: texture `none.png` is left out: there is no file `none.png`";
    assert_eq!(warnings, [missing, untextured]);
    Ok(())
}

#[test]
fn what_a_mesh_names_stays_in_its_folder_or_the_scenes() -> Result<()> {
    let obj = format!("mtllib mtl\\a.mtl\nusemtl a\n{TRIANGLE}");
    let mtl = |name: &str| text(format!("newmtl a\nmap_Kd {name}\n"));
    let files = |name: &str| {
        Memory::new()
            .with("meshes/a.obj", text(obj.as_str()))
            .with("meshes/mtl/a.mtl", mtl(name))
            .with("meshes/t 1.png", png([1; 4]))
            .with("scene/t.png", png([1; 4]))
            .with("other/t.png", png([1; 4]))
    };
    for name in ["..\\t 1.png", "t 1.png", "t 1.png # a comment", "../../scene/t.png", "-s 2 2 t 1.png"] {
        let (model, warnings) = load(&files(name), "../meshes/a.obj")?;
        assert!(model.materials[0].diffuse_map.is_some() && warnings.is_empty(), "{name}: {warnings:?}");
    }
    for name in ["../../other/t.png", "/other/t.png", "https://a/t.png", ".", "../../../t.png"] {
        let (model, warnings) = load(&files(name), "../meshes/a.obj")?;
        assert!(model.materials[0].diffuse_map.is_none(), "{name}");
        assert!(warnings.len() == 1 && warnings[0].contains(name), "{name}: {warnings:?}");
    }
    Ok(())
}

#[test]
fn several_libraries_and_names_with_spaces_are_found() -> Result<()> {
    let obj =
        format!("usemtl red # old\n{TRIANGLE}usemtl wall  #2\nf 1 2 3\nmtllib a b.mtl none.mtl c.mtl\n");
    let files = Memory::new()
        .with("scene/a.obj", text(obj))
        .with("scene/a b.mtl", text("newmtl red\nKd 1 0 0\n"))
        .with("scene/c.mtl", text("newmtl wall #1\nKd 0 1 0\nnewmtl wall #2\nKd 0 0 1\n"));
    let (model, warnings) = load(&files, "a.obj")?;
    let colours: Vec<_> = model.materials.iter().map(|m| m.diffuse).collect();
    assert_eq!(colours, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(warnings.len() == 1 && warnings[0].contains("none.mtl"), "{warnings:?}");
    Ok(())
}

#[test]
fn of_two_materials_with_one_name_the_later_counts_and_that_is_said() -> Result<()> {
    let load = |mtl: &str| {
        let obj = format!("mtllib a.mtl\nusemtl a\n{TRIANGLE}");
        let files = Memory::new().with("scene/a.obj", text(obj)).with("scene/a.mtl", text(mtl));
        load(&files, "a.obj")
    };
    let (model, warnings) = load("newmtl a\nKd 1 0 0\nnewmtl b\nnewmtl a\nKd 0 1 0\nnewmtl b\nd 0.5\n")?;
    assert_eq!(model.materials[0].diffuse, [0.0, 1.0, 0.0]);
    // No face shows what became of `b`.
    assert_eq!(warnings, ["a.mtl:4: there was a material `a` in a.mtl:1; this one is used"]);
    let (_, warnings) = load("newmtl a\nKd 1 0 0\nnewmtl a\nKd 1 0 0\n")?;
    assert!(warnings.is_empty(), "{warnings:?}");
    Ok(())
}

#[test]
fn keywords_with_other_capitals_are_told() -> Result<()> {
    let files = Memory::new()
        .with(
            "scene/a.obj",
            text(format!("MTLLIB a.mtl\nmtllib a.mtl\nusemtl mu\u{308} हिन्दी\n{TRIANGLE}F 1 2 3\n")),
        )
        .with("scene/a.mtl", text("newmtl m\nkd 1 0 0\nNS 3\nMAP_KD t.png\nMAP_KE t.png\n"));
    let (_, warnings) = load(&files, "a.obj")?;
    let said = [
        "a.obj:1: `MTLLIB` is left out: the keyword is written `mtllib`",
        "a.obj:9: `F` is left out: the keyword is written `f`",
        "a.mtl:2: `kd` is left out: the keyword is written `Kd`",
        "a.mtl:4: `MAP_KD` is left out: the keyword is written `map_Kd`",
        "a.mtl:5: `MAP_KE` is left out: the keyword is written `map_Ke`",
        "a.obj:3: there is no material `mu\u{308} हिन्दी`; the default is used",
    ];
    assert_eq!(warnings, said);
    Ok(())
}

#[test]
fn names_with_a_hash_are_one_material_each() -> Result<()> {
    let colours = |mtl: &str, uses: &[&str]| {
        let faces: String = uses.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect();
        let files = Memory::new()
            .with("scene/a.obj", text(format!("mtllib a.mtl\n{TRIANGLE}{faces}")))
            .with("scene/a.mtl", text(mtl));
        let (model, warnings) = load(&files, "a.obj")?;
        let of = |material: u32| model.materials[material as usize].diffuse;
        let all = model.triangles.iter().skip(1).map(|face| of(face.material)).collect::<Vec<_>>();
        Ok::<_, groundglass::error::Error>((all, warnings.len()))
    };
    let (red, green, none) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.8; 3]);
    let named = |[a, b]: [&str; 2]| format!("newmtl {a}\nKd 1 0 0\nnewmtl {b}\nKd 0 1 0\n");
    let hex = named(["#ff0000", "#00ff00"]);
    assert_eq!(colours(&hex, &["#ff0000", "#00ff00", ""])?, (vec![red, green, none], 1));
    // Two names that differ behind the sign, and a third; one name with a comment, and with another.
    assert_eq!(colours(&named(["a #1", "a #2"]), &["a #1", "a #3"])?, (vec![red, none], 1));
    assert_eq!(colours(&named(["a # old", "b"]), &["a # new", "b # or c"])?, (vec![red, green], 0));
    Ok(())
}

#[test]
fn each_map_lies_where_its_own_options_say() -> Result<()> {
    let corners = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let load = |options: [&str; 2], far: f64| {
        let vt: String = corners.iter().map(|uv| format!("vt {} {}\n", uv.x + far, uv.y)).collect();
        let obj = format!("mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{vt}f 1/1 2/2 3/3\n");
        let mtl = format!("newmtl a\nmap_Kd {} t.png\nmap_d {} t.png\n", options[0], options[1]);
        let files = Memory::new()
            .with("scene/a.obj", text(obj))
            .with("scene/a.mtl", text(mtl))
            .with("scene/t.png", png([1; 4]));
        load(&files, "a.obj")
    };
    for (options, first, second) in [
        (["-s 2 2 -o 0.25 0", "-s 3 1 -o 0 0.5"], [(2.0, 0.25), (2.0, 0.0)], [(3.0, 0.0), (1.0, 0.5)]),
        (["", "-s 0 -1 -o 7 0.5"], [(1.0, 0.0), (1.0, 0.0)], [(0.0, 7.0), (-1.0, 0.5)]),
        (["-o 0.5", "-o 0.5"], [(1.0, 0.5), (1.0, 0.0)], [(1.0, 0.5), (1.0, 0.0)]),
    ] {
        for far in [0.0, 5000.0, 1e6] {
            let (model, warnings) = load(options, far)?;
            assert!(warnings.is_empty(), "{warnings:?}");
            for (i, corner) in model.triangles[0].texcoords.into_iter().zip(corners) {
                let uv = model.texcoords[i as usize].as_dvec2();
                let at = corner + DVec2::new(far, 0.0);
                let lies =
                    |of: [(f64, f64); 2]| DVec2::new(of[0].0 * at.x + of[0].1, of[1].0 * at.y + of[1].1);
                // But for whole repeats, which do not show.
                let off = |a: DVec2, b: DVec2| (a - b - (a - b).round()).abs().max_element();
                let mapping = model.materials[0].opacity_mapping;
                assert!(off(uv, lies(first)) < 1e-3, "{options:?}, {far}: {uv}");
                assert!(off(mapping.at(uv), lies(second)) < 2e-3, "{options:?}, {far}: {uv}");
            }
        }
    }
    let (_, warnings) = load(["", "-s 0.3 1"], 0.0)?;
    assert!(warnings.is_empty(), "{warnings:?}");
    let (_, warnings) = load(["", "-s 0.3 1"], 1e6)?;
    assert_eq!(
        warnings,
        ["a.obj:9: texture coordinates so far from 0 lose digits: `map_d` has a scale of its own"]
    );
    let (_, warnings) = load(["-s 0 1", "-s 2 2"], 0.0)?;
    assert_eq!(
        warnings,
        ["a.mtl:3: `map_d` is placed by the options of `map_Kd`: a scale of 0 leaves it none of its own"]
    );
    Ok(())
}

#[test]
fn the_digest_is_of_bytes_not_of_paths() -> Result<()> {
    let digest = |folder: &str, texel: u8| {
        let obj = format!("mtllib a.mtl\nusemtl a\n{TRIANGLE}");
        let files = Memory::new()
            .with(&format!("{folder}/a.obj"), text(obj))
            .with(&format!("{folder}/a.mtl"), text("newmtl a\nmap_Kd t.png\nmap_d t.png\n"))
            .with(&format!("{folder}/t.png"), png([texel; 4]));
        let mut loader = AssetLoader::new(&files, Path::new("scene"));
        let name = format!("../{folder}/a.obj");
        let model = loader.load_obj(&name)?;
        assert!(Arc::ptr_eq(&model, &loader.load_obj(&name)?), "read once");
        assert_eq!(model.textures, 1, "one file, decoded for two uses");
        Ok::<_, groundglass::error::Error>(loader.digest())
    };
    assert_eq!(digest("x", 1)?, digest("y", 1)?);
    assert_ne!(digest("x", 1)?, digest("x", 2)?);
    Ok(())
}

#[test]
fn a_mesh_that_cannot_be_says_where_and_why() {
    let files =
        Memory::new().with("scene/a.obj", text("v 0 0 0\nf 1 1 2\n")).with("scene/b.obj", text("v 0 0 0\n"));
    let say = |name: &str| load(&files, name).expect_err("it cannot be");
    assert!(say("a.obj").to_string().starts_with("a.obj:2: a face names vertex 2"), "{}", say("a.obj"));
    for name in ["b.obj", "none.obj", "/scene/a.obj", "../scene"] {
        let error = say(name);
        assert!(error.kind() == ErrorKind::Invalid && error.to_string().contains(name), "{error}");
    }
}

/// Files of which one, by the end of its name, is there and cannot be read.
struct Unreadable(Memory, &'static str);

impl Source for Unreadable {
    fn argument(&self, path: &Path) -> Result<PathBuf> {
        self.0.argument(path)
    }

    fn named(&self, folder: &Path, written: &str) -> Result<PathBuf> {
        self.0.named(folder, written)
    }

    fn asset(&self, folder: &Path, written: &str, fences: &[PathBuf]) -> Result<PathBuf> {
        self.0.asset(folder, written, fences)
    }

    fn read(&self, file: &Path, limit: u64) -> Result<Cow<'_, [u8]>> {
        if file.ends_with(self.1) {
            return Err(Error::new(ErrorKind::Io, "cannot read it: too many open files"));
        }
        self.0.read(file, limit)
    }
}

#[test]
fn what_is_there_and_cannot_be_read_is_an_error_and_not_another_picture() {
    let files = Memory::new()
        .with("scene/a.obj", text(format!("mtllib a.mtl\nusemtl m\n{TRIANGLE}")))
        .with("scene/a.mtl", text("newmtl m\nmap_Kd t.png\n"))
        .with("scene/t.png", png([255; 4]));
    for (name, place) in [("a.mtl", "a.obj:1: "), ("t.png", "a.mtl:2: ")] {
        let files = Unreadable(files.clone(), name);
        let error = AssetLoader::new(&files, Path::new("scene")).load_obj("a.obj").expect_err(name);
        assert_eq!(error.kind(), ErrorKind::Io);
        assert!(error.to_string().starts_with(&format!("{place}cannot read it")), "{error}");
    }
}

/// A scene of these meshes.
fn described(names: &[&str]) -> Result<SceneDescription> {
    let camera = "[camera]\neye_m = [0, 0, 5]\nlook_at_m = [0, 0, 0]\nfocal_length_mm = 150\nf_number = 8\nfilm = \"4x5\"\n[focus]\ndistance_m = 1\n";
    let meshes = names.iter().map(|name| format!("[[mesh]]\npath = \"{name}\"\n")).collect::<String>();
    parse(&format!("{camera}{meshes}"), "a.toml")?.describe()
}

/// It, loaded on so many threads.
fn scene(files: &Memory, names: &[&str], threads: usize, memory: Option<u64>) -> Result<Scene> {
    let settings = LoadSettings { threads: Some(threads), memory, ..LoadSettings::default() };
    described(names)?.load_with(files, Path::new("scene"), settings)
}

#[test]
fn meshes_read_side_by_side_are_those_read_one_after_the_other() -> Result<()> {
    let obj = |mtl: &str, z: usize| {
        let more = format!("v 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nf 1 2 3\n").repeat(100 * z);
        text(format!("mtllib {mtl}\nusemtl a\n{TRIANGLE}usemtl lost\n{more}"))
    };
    let files = Memory::new()
        .with("scene/a.obj", obj("a.mtl", 1))
        .with("scene/b.obj", obj("b.mtl", 90))
        .with("scene/c.obj", obj("a.mtl", 3))
        .with("scene/bad.obj", text("v 0 0 0\nf 1 1 2\n"))
        .with("scene/a.mtl", text("newmtl a\nmap_Kd t.png\n"))
        .with("scene/b.mtl", text("newmtl a\nmap_Kd none.png\nmap_d t.png\n"))
        .with("scene/t.png", png([9, 8, 7, 6]));
    let names = ["c.obj", "a.obj", "./c.obj", "b.obj", "a.obj"];

    let mut loader = AssetLoader::new(&files, Path::new("scene"));
    let models = names.map(|name| loader.load_obj(name));
    let models = models.into_iter().collect::<Result<Vec<_>>>()?;
    let warnings = said(loader.warnings());
    assert_eq!(warnings.len(), 4, "{warnings:?}");
    for threads in [1, 2, 5] {
        let scene = scene(&files, &names, threads, None)?;
        assert_eq!(said(&scene.warnings), warnings);
        assert_eq!(scene.assets_digest, loader.digest());
        for (mesh, model) in scene.meshes.iter().zip(&models) {
            let told = (mesh.triangles, mesh.materials, mesh.textures);
            assert_eq!(told, (model.triangles.len(), model.named_materials, model.textures));
        }
        // One picture, decoded once for all.
        let maps: Vec<_> = scene.surfaces.materials.iter().filter_map(|m| m.diffuse_map.as_ref()).collect();
        assert!(maps.len() > 1 && maps.iter().all(|map| Arc::ptr_eq(map, maps[0])));

        let refused = self::scene(&files, &["a.obj", "bad.obj", "none.obj"], threads, None);
        let message = refused.expect_err("one is bad").to_string();
        assert!(message.starts_with("bad.obj:2: a face names vertex 2"), "{message}");
    }
    Ok(())
}

#[test]
fn meshes_that_fit_one_after_the_other_are_read_though_they_do_not_fit_side_by_side() -> Result<()> {
    let large = format!("{TRIANGLE}{}", "f 1 2 3\n".repeat(4000));
    let names = ["a.obj", "b.obj", "c.obj"];
    let files = names
        .iter()
        .fold(Memory::new(), |files, name| files.with(&format!("scene/{name}"), text(large.as_str())));
    // Reading one takes what all three are in the end and more.
    let least = |names: &[&str]| {
        (1..200).map(|at| at << 16).find(|&memory| scene(&files, names, 2, Some(memory)).is_ok())
    };
    let (one, three) = (least(&names[..1]).expect("it fits"), least(&names).expect("they fit"));
    println!("one takes {one} bytes, three {three}");
    assert!(one < three && three < 2 * one, "{one} {three}");
    Ok(())
}

/// Memory for a texture before, a library and a mesh after it: whatever there is, it is as if one came after the other.
#[test]
fn what_memory_leaves_out_does_not_depend_on_what_is_read_side_by_side() -> Result<()> {
    let wide = square_png(512, [1, 2, 3, 255]);
    let materials = (0..4000).map(|k| format!("newmtl m{k}\n")).collect::<String>();
    let (mut left_out, mut refused, mut loaded) = (0, 0, 0);
    for padding in [0, 200] {
        let first = format!("mtllib a.mtl\nusemtl a\n{TRIANGLE}{}", "# nothing\n".repeat(padding));
        let files = Memory::new()
            .with("scene/a.obj", text(first))
            .with("scene/b.obj", text(format!("mtllib b.mtl\nusemtl m7\n{TRIANGLE}")))
            .with("scene/a.mtl", text("newmtl a\nmap_Kd wide.png\n"))
            .with("scene/b.mtl", text(materials.clone()))
            .with("scene/wide.png", wide.clone());
        for memory in (1..80).map(|at| at << 18) {
            let mut loader = AssetLoader::new(&files, Path::new("scene")).with_memory(memory);
            let alone = ["a.obj", "b.obj"].map(|name| loader.load_obj(name).map(|_| ()));
            let scene = scene(&files, &["a.obj", "b.obj"], 2, Some(memory));
            match (alone.into_iter().collect::<Result<()>>(), scene) {
                (Ok(()), Ok(scene)) => {
                    assert_eq!(said(&scene.warnings), said(loader.warnings()), "{memory} bytes");
                    assert_eq!(scene.assets_digest, loader.digest(), "{memory} bytes");
                    left_out += usize::from(!scene.warnings.is_empty());
                    loaded += usize::from(scene.warnings.is_empty());
                }
                (Err(alone), Err(scene)) => {
                    assert_eq!(alone.kind(), scene.kind(), "{memory} bytes: {alone}, {scene}");
                    refused += 1;
                }
                (alone, scene) => panic!("{memory} bytes: {alone:?}, {:?}", scene.map(|_| ())),
            }
        }
    }
    println!("{refused} refused, {left_out} without the library, {loaded} whole");
    assert!(refused > 0 && left_out > 0 && loaded > 0);
    Ok(())
}

#[test]
fn progress_ends_with_all_of_each_file() -> Result<()> {
    let names = ["a.obj", "b.obj"];
    let files =
        names.iter().fold(Memory::new(), |files, name| files.with(&format!("scene/{name}"), text(TRIANGLE)));
    let ends = |load: &dyn Fn(&Progress<'_>) -> Result<()>| {
        let told = Mutex::new(BTreeMap::new());
        load(&|what: &str, done: u64, total: u64| {
            told.lock().expect("nobody panicked").insert(what.to_owned(), (done, total));
        })?;
        let length = TRIANGLE.len() as u64;
        let told = told.into_inner().expect("nobody panicked");
        assert!(names.iter().all(|&name| told.get(name) == Some(&(length, length))), "{told:?}");
        Ok(())
    };
    ends(&|tell| {
        let mut loader = AssetLoader::new(&files, Path::new("scene")).with_progress(tell);
        names.iter().try_for_each(|name| loader.load_obj(name).map(|_| ()))
    })?;
    ends(&|tell| {
        let settings = LoadSettings { progress: Some(tell), ..LoadSettings::default() };
        described(&names)?.load_with(&files, Path::new("scene"), settings).map(|_| ())
    })
}
