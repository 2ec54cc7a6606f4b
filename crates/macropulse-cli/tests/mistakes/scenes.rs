//! Scene files and their environments; meshes are in `bad_mesh.rs`.

use super::{Desk, Row, files_refused};

/// Behind a line with the version.
const ROWS: &[Row] = &[
    ("[object]\nname = \"a\"", &["mine.toml:2:1:", "write [[object]], in two brackets"]),
    ("[[objects]]\ncar = {}", &["mine.toml:2:3:", "did you mean `object`?"]),
    ("[[object]]\nname = \"a\"", &["mine.toml:2:1:", "exactly one of `mesh`, `car` and `shape`"]),
    (
        "[[object]]\nmesh = \"gone.obj\"",
        &["gone.obj: cannot be read: there is no such file", "the folder of its file"],
    ),
    ("[[object]]\nmesh = \"a.fbx\"", &["a.fbx", "use .obj, .stl, .ply, .glb or .gltf"]),
    ("[[object]]\nmesh = gone.obj", &["mine.toml:3:8:", "text stands in quotes"]),
    (
        "[[object]]\nmesh = \"a.obj\"\nunit = \"metre\"",
        &["mine.toml:4:8:", "`metre`", "m, cm, mm, in, ft"],
    ),
    (
        "[[object]]\nmesh = \"a.obj\"\nunit = 1",
        &["mine.toml:4:8:", "`unit` is 1, but must be \"m\" or \"cm\""],
    ),
    ("[[object]]\nmesh = \"a.obj\"\nup = \"Z\"", &["mine.toml:4:6:", "did you mean `z`?"]),
    (
        "[[object]]\nmesh = \"a.obj\"\nup = \"z\"\nforward = \"z\"",
        &["mine.toml:5:11:", "name two different ones"],
    ),
    ("[[object]]\nmesh = \"a.obj\"\nscale = 0", &["mine.toml:4:9:", "above zero"]),
    (
        "[[object]]\nshape = { box = { size_m = [1, 1] } }",
        &["mine.toml:3:28:", "`size_m` has 2 entries", "a list of 3 numbers"],
    ),
    (
        "[[object]]\nshape = { box = { size_m = [0, 1, 1] } }",
        &["mine.toml:3:9:", "`size_m` must be finite and above zero"],
    ),
    (
        "[[object]]\nshape = { box = { size_m = 2 } }",
        &["mine.toml:3:28:", "`size_m` is 2", "as [1.0, 2.0, 3.0]"],
    ),
    (
        "[[object]]\nshape = { box = { size = [1, 1, 1] } }",
        &["mine.toml:3:19:", "did you mean `size_m`?"],
    ),
    (
        "[[object]]\nshape = { cube = { size_m = [1, 1, 1] } }",
        &["mine.toml:3:11:", "`cube`", "plane, sphere, box"],
    ),
    ("[[object]]\nshape = \"box\"", &["mine.toml:3:9:", "{ box = … }"]),
    (
        "[[object]]\nshape = { sphere = { radius_m = -1 } }",
        &["mine.toml:3:9:", "`radius_m` must be finite and above zero"],
    ),
    (
        "[[object]]\nshape = { sphere = { diameter_m = 1 } }",
        &["mine.toml:3:22:", "`diameter_m`", "radius_m"],
    ),
    ("[[object]]\nshape = { person = { height_m = 180 } }", &["mine.toml:3:9:", "from 0.4 to 2.6"]),
    ("[[object]]\nshape = { plane = { normal = [0, 0, 0] } }", &["mine.toml:3:9:", "not zero"]),
    (
        "[[object]]\nshape = { sphere = { radius_m = 1 }, box = { size_m = [1, 1, 1] } }",
        &["mine.toml:3:9:", "exactly one, as { sphere = … }"],
    ),
    ("[[object]]\ncar = true", &["mine.toml:3:7:", "`car` is true", "a table, as {}"]),
    (
        "[[object]]\nname = \"a\"\ncar = {}\n[[object]]\nname = \"a\"\ncar = {}",
        &["mine.toml:6:8:", "line 3", "another name"],
    ),
    ("[[object]]\ncar = {}\nyaw = 90", &["mine.toml:4:1:", "did you mean `yaw_deg`?"]),
    ("[[object]]\ncar = {}\nyaw_rad = 1.57", &["mine.toml:4:1:", "did you mean `yaw_deg`?"]),
    (
        "[[object]]\ncar = {}\nyaw_deg = \"90\"",
        &["mine.toml:4:11:", "`yaw_deg` is the text \"90\"", "take the quotes away"],
    ),
    (
        "[[object]]\ncar = {}\nyaw_deg = nan",
        &["mine.toml:4:11:", "yaw_deg must be a number from -36000 to 36000"],
    ),
    (
        "[[object]]\ncar = {}\nmaterials = \"white\"",
        &["mine.toml:4:13:", "`materials` is the text", "a table"],
    ),
    (
        "[[object]]\ncar = {}\nmaterials = { wheel = \"rubber\" }",
        &["mine.toml:4:23:", "it has plastic-black"],
    ),
    ("[[object]]\ncar = {}\nmaterial = \"steel\"", &["mine.toml:4:12:", "[[material]]", "metal"]),
    ("[[object]]\ncar = {}\ntarget = \"yes\"", &["mine.toml:4:10:", "true or false"]),
    (
        "[[object]]\ncar = {}\nposition_m = 30",
        &["mine.toml:4:14:", "`position_m` is 30", "as [1.0, 2.0, 3.0]"],
    ),
    ("[[object]]\ncar = {}\nposition_m = [30, 0]", &["mine.toml:4:14:", "has 2 entries"]),
    ("[[object]]\ncar = {}\nposition_m = [30, 0, 1, 90]", &["mine.toml:4:14:", "has 4 entries"]),
    (
        "[[object]]\ncar = {}\nposition = [30, 0, 0]",
        &["mine.toml:4:1:", "did you mean `position_m`?"],
    ),
    (
        "[[object]]\ncar = {}\ncopies = { position_m = [1, 2, 3] }",
        &["mine.toml:4:10:", "a list, as [ … ]"],
    ),
    (
        "[[object]]\ncar = {}\nvelocity_km_h = [10, 0, 0]",
        &["mine.toml:4:1:", "did you mean `velocity_m_s`?"],
    ),
    (
        "[[object]]\nshape = { sphere = { radius_m = 1 } }\nunit = \"cm\"",
        &["mine.toml:4:8:", "`unit` belongs to objects with a `mesh`"],
    ),
    (
        "[[object]]\nshape = { sphere = { radius_m = 1 } }\nmaterials = { all = \"white\" }",
        &["mine.toml:4:21:", "`materials` belongs to objects with a `mesh` or `car`"],
    ),
    ("ground = \"asphalt\"", &["mine.toml:2:10:", "`ground` is the text", "{ material = … }"]),
    ("ground = { material = \"asphlat\" }", &["mine.toml:2:23:", "did you mean \"asphalt\"?"]),
    ("ground = {}", &["mine.toml:2:10:", "`material` is missing"]),
    ("[ground]\nmaterial = \"grass\"\nheight_m = 1", &["mine.toml:4:1:", "`height_m`", "z_m"]),
    (
        "[[material]]\nname = \"mine\"\ndiffuse = 10",
        &["mine.toml:4:11:", "diffuse is 10", "from 0 to 1"],
    ),
    ("[[material]]\nname = \"mine\"\ndiffuse = -0.1", &["mine.toml:4:11:", "from 0 to 1"]),
    (
        "[[material]]\nname = \"mine\"\nreflectance = 0.1",
        &["mine.toml:4:1:", "`reflectance`", "diffuse"],
    ),
    ("[[material]]\nname = \"mine\"", &["mine.toml:2:1:", "needs at least `diffuse`"]),
    ("[sensor]\nheight_m = 2", &["mine.toml:3:1:", "`height_m`", "position_m"]),
    (
        "sensor = \"peregrine\"\n[[object]]\ncar = {}",
        &["mine.toml:2:10:", "`sensor` is the text \"peregrine\"", "position_m = …"],
    ),
    ("[[interferers]]\nsensor = \"perigrine\"", &["mine.toml:3:10:", "did you mean `peregrine`?"]),
    ("[[interferers]]\nname = \"x\"", &["mine.toml:2:1:", "`sensor` is missing"]),
    ("environment = \"fog\"\n[[object]]\ncar={}", &["mine.toml:2:15:", "did you mean `fog-50m`?"]),
    (
        "environment = 3\n[[object]]\ncar={}",
        &["mine.toml:2:15:", "the name of an environment, or a table"],
    ),
    ("[environment]\nvisibility_m = 50", &["mine.toml:3:1:", "did you mean `visibility_km`?"]),
    (
        "[environment]\nvisibility_km = \"50\"",
        &["mine.toml:3:1:", "a number from 0.01 to 1000", "take the quotes away"],
    ),
    ("[environment]\nvisibility_km = -1", &["mine.toml:3:1:", "between 0.01 and 1000"]),
    ("[environment]\nsky = \"clear\"", &["mine.toml:3:1:", "known are day, overcast, night"]),
    ("[environment]\nbase = \"clear-dya\"", &["mine.toml:3:1:", "did you mean `clear-day`?"]),
    ("[environment]\nalbedo = 30", &["mine.toml:3:1:", "between 0 and 1"]),
    ("[environment]\nrain = 3", &["mine.toml:3:1:", "did you mean `rain_mm_h`?"]),
    ("[environment]\nidealised = \"background\"", &["mine.toml:3:1:", "a list, as [ … ]"]),
    (
        "[environment]\nidealised = [\"sun\"]",
        &["mine.toml:3:1:", "there are atmosphere and background"],
    ),
];

/// Whole files.
const WHOLE: &[Row] = &[
    ("[[object]]\ncar = {}", &["mine.toml:1:1:", "`version` is missing"]),
    (
        "version = 1.0\n[[object]]\ncar = {}",
        &["mine.toml:1:11:", "`version` is 1.0", "a whole number"],
    ),
    ("version = 2\n[[object]]\ncar = {}", &["mine.toml:1:11:", "write version = 1"]),
];

#[test]
fn scene_files() {
    let desk = Desk::new();
    desk.put("a.obj", "v 0 -2 -2\nv 0 2 -2\nv 0 0 2\nf 1 2 3\n");
    files_refused(&desk, "version = 1\n", ROWS);
    files_refused(&desk, "", WHOLE);
}

/// The control, and a mesh whose unit was forgotten: it is read, and told.
#[test]
fn a_mesh_in_millimetres() {
    let desk = Desk::new();
    let object =
        "version = 1\n[[object]]\nname = \"thing\"\nmesh = \"a.obj\"\nmaterial = \"white\"\n";
    desk.put("mine.toml", object);
    for (size, is_told) in [("2000", true), ("2", false)] {
        let mesh = "v 0 -S -S\nv 0 S -S\nv 0 0 S\nf 1 2 3\n".replace('S', size);
        let ran = desk.put("a.obj", &mesh).run("check mine.toml");
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let said = ran.out.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(said.contains("hardly anything is 4000 m long"), is_told, "{said}");
    }
}
