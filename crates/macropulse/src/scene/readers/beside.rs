//! The files that a mesh names: materials of an OBJ, buffers of a glTF.

use std::path::{Component, Path, PathBuf};

use crate::scene::error::Error;

/// The places at which files that a mesh names may lie.
#[derive(Debug, Clone, Copy)]
pub(in crate::scene) struct Reach<'a> {
    /// The folder of the scene.
    pub scene: &'a Path,
    /// True if they may lie anywhere else as well.
    pub outside: bool,
}

impl Reach<'_> {
    /// The file that the one at `mesh` names, from its own folder. A name that leads nowhere but down
    /// is followed wherever links on the disk lead.
    ///
    /// # Errors
    /// If it lies neither in the folder of the mesh nor in that of the scene, and may not.
    pub(super) fn beside(&self, mesh: &Path, named: &str) -> Result<PathBuf, Error> {
        let folder = mesh.parent().unwrap_or(Path::new(""));
        let file = folder.join(named);
        let leads_down = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        if self.outside || Path::new(named).components().all(leads_down) {
            return Ok(file);
        }
        let around = file.parent().and_then(real);
        let is_in = |folder: &Path| match (&around, real(folder)) {
            (Some(around), Some(folder)) => around.starts_with(folder),
            _ => false,
        };
        if is_in(folder) || is_in(self.scene) {
            return Ok(file);
        }
        Err(Error::Outside { path: mesh.to_owned(), named: named.to_owned() })
    }
}

/// A folder without links and steps upwards; `None` where there is none.
fn real(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_name_may_lead_up_as_far_as_the_scene() {
        let around = tempfile::tempdir().unwrap();
        let scene = around.path().join("scene");
        fs::create_dir_all(scene.join("meshes/parts")).unwrap();
        let mesh = scene.join("meshes/a.obj");
        let may = |named: &str, outside: bool| {
            Reach { scene: &scene, outside }.beside(&mesh, named).is_ok()
        };
        for named in ["a.mtl", "./a.mtl", "parts/a.mtl", "parts/../a.mtl", "../a.mtl", "../b/a.mtl"]
        {
            assert!(may(named, true), "{named}");
            assert_eq!(may(named, false), !named.starts_with("../b"), "{named}");
        }
        for named in ["../../a.mtl", "parts/../../../a.mtl", "/etc/hostname", "../../gone/a.mtl"] {
            assert!(may(named, true) && !may(named, false), "{named}");
        }
        let inside = scene.join("a.mtl").display().to_string();
        assert!(may(&inside, false), "an absolute name of a file in the folder of the scene");
    }

    /// The user's own word leads to the mesh, and what lies beside it belongs to it.
    #[test]
    fn a_mesh_outside_may_name_its_neighbours() {
        let (scene, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let reach = Reach { scene: scene.path(), outside: false };
        let mesh = other.path().join("a.obj");
        assert!(reach.beside(&mesh, "a.mtl").is_ok());
        let told = reach.beside(&mesh, "../a.mtl").unwrap_err().to_string();
        assert!(told.contains("names ../a.mtl, which lies outside"), "{told}");
        assert!(told.contains("--outside-files"), "{told}");
    }
}
