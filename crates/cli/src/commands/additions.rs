//! Lights, a camera and an environment given on the command line, besides what the scene's files hold.

use super::Failure;
use lightgraph::internals::scene::{AddedCamera, AddedEnvironment, AddedLight, Additions, Loaded};
use lightgraph::{Checked, Diagnostic, Scene};
use std::path::{Path, PathBuf};

/// What a command adds to a scene.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct AdditionArgs {
    /// Add a sun: compass bearing (0 north, along −Z; 90 east, along +X), height above the horizon, both in degrees,
    /// and lux
    #[arg(long, value_name = "AZ,EL,LUX", allow_hyphen_values = true)]
    pub sun: Vec<String>,
    /// Add a light: point:x,y,z,CANDELA or spot:x,y,z,TO_X,TO_Y,TO_Z,CANDELA,DEGREES (may be repeated)
    #[arg(long, value_name = "KIND:NUMBERS")]
    pub light: Vec<String>,
    /// Light from all around: a panorama (.hdr, .exr), `sky`, `sky:TURBIDITY`, or radiance as one number or R,G,B
    #[arg(long, value_name = "FILE|sky|RADIANCE")]
    pub environment: Option<String>,
    /// Degrees that the environment's panorama is turned by, towards the east
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, requires = "environment")]
    pub environment_rotation: Option<f32>,
    /// What the environment's light is multiplied by
    #[arg(long, value_name = "FACTOR", requires = "environment")]
    pub environment_strength: Option<f32>,
    /// Look from here
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera_at: Option<String>,
    /// Look to this place; without it, to the middle of the scene
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, requires = "camera_at")]
    pub look_at: Option<String>,
    /// The vertical angle of that look, in degrees
    #[arg(long, value_name = "DEGREES", requires = "camera_at")]
    pub fov: Option<f32>,
    /// Leave a scene without light in the dark
    #[arg(long)]
    pub no_default_light: bool,
}

impl AdditionArgs {
    /// Loads a scene with what is added.
    ///
    /// # Errors
    /// Arguments that say nothing usable, and the scene's faults.
    pub fn load(&self, path: &Path) -> Result<Loaded, Failure> {
        Ok(Scene::load_with(path, &self.additions()?)?)
    }

    /// What the arguments say.
    ///
    /// # Errors
    /// Arguments that say nothing usable.
    pub fn additions(&self) -> Result<Additions, Failure> {
        let sun = |text: &String| {
            let [azimuth, elevation, lux] = numbers("--sun", text, "135,40,3")?;
            let sun = AddedLight::Sun { azimuth, elevation, lux, color: [1.0; 3] };
            checked("--sun", text, sun.check()).map(|()| ("sun".to_owned(), sun))
        };
        let mut lights = self.sun.iter().map(sun).collect::<Result<Vec<_>, _>>()?;
        for text in &self.light {
            let light = light(text)?;
            checked("--light", text, light.check())?;
            lights.push(("light".into(), light));
        }
        let mut cameras = vec![];
        if let Some(text) = &self.camera_at {
            let at = numbers("--camera-at", text, "0,1.6,4")?;
            let look_at = self.look_at.as_ref().map(|text| numbers("--look-at", text, "0,1,0")).transpose()?;
            let camera = AddedCamera { at, look_at, fov: self.fov.unwrap_or(50.0) };
            checked("--camera-at", text, camera.check())?;
            cameras.push(("here".into(), camera));
        }
        let environment = self.environment.as_ref().map(|text| self.environment(text)).transpose()?;
        Ok(Additions { lights, cameras, environment, no_default_light: self.no_default_light })
    }

    fn environment(&self, text: &str) -> Result<AddedEnvironment, Failure> {
        const USUAL: &str = "sky.hdr, sky, sky:3, 1 or 0.2,0.3,0.5";
        let strength = self.environment_strength.unwrap_or(1.0);
        let extension = Path::new(text).extension().map(|e| e.to_string_lossy().to_lowercase());
        let environment = if matches!(extension.as_deref(), Some("hdr" | "exr")) {
            AddedEnvironment::File {
                file: PathBuf::from(text),
                rotation: self.environment_rotation.unwrap_or(0.0),
                strength,
            }
        } else if self.environment_rotation.is_some() {
            let d = Diagnostic::error("--environment-rotation turns a panorama, and there is none");
            return Err(Failure::Usage(d.help("give --environment FILE.hdr; a sky stands where its sun does").into()));
        } else if let Some(rest) = text.strip_prefix("sky") {
            let turbidity = match rest.strip_prefix(':') {
                Some(number) => {
                    let [turbidity] = numbers("--environment", number, USUAL)?;
                    turbidity
                }
                None if rest.is_empty() => 2.5,
                None => return Err(unfit("--environment", text, USUAL)),
            };
            let (azimuth, elevation, sun_lux, ground) = (None, None, None, [0.2; 3]);
            AddedEnvironment::Sky { azimuth, elevation, sun_lux, turbidity, ground, strength }
        } else {
            let radiance = match text.contains(',') {
                true => numbers("--environment", text, USUAL)?,
                false => numbers::<1>("--environment", text, USUAL).map(|[all]| [all; 3])?,
            };
            AddedEnvironment::Constant { radiance: radiance.map(|r| strength * r) }
        };
        checked("--environment", text, environment.check()).map(|()| environment)
    }
}

/// A scene, or none where none is given; then nothing can be added either.
///
/// # Errors
/// As [`AdditionArgs::load`].
pub fn load_some(path: Option<&Path>, additions: &AdditionArgs) -> Checked<Option<Loaded>> {
    path.map(|path| additions.load(path)).transpose().map_err(Into::into)
}

fn light(text: &str) -> Result<AddedLight, Failure> {
    const USUAL: &str = "point:0,2,0,10 or spot:0,3,0,0,0,0,100,60";
    match text.split_once(':') {
        Some(("point", rest)) => {
            let [x, y, z, candela] = numbers("--light", rest, USUAL)?;
            Ok(AddedLight::Point { at: [x, y, z], candela, color: [1.0; 3], range: None })
        }
        Some(("spot", rest)) => {
            let [x, y, z, to_x, to_y, to_z, candela, angle] = numbers("--light", rest, USUAL)?;
            let (at, look_at) = ([x, y, z], [to_x, to_y, to_z]);
            Ok(AddedLight::Spot { at, look_at, candela, angle, inner: 0.0, color: [1.0; 3], range: None })
        }
        _ => Err(unfit("--light", text, USUAL)),
    }
}

fn numbers<const N: usize>(argument: &str, text: &str, usual: &str) -> Result<[f32; N], Failure> {
    let all: Option<Vec<f32>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f32| x.is_finite())).collect();
    all.and_then(|all| all.try_into().ok()).ok_or_else(|| unfit(argument, text, usual))
}

fn unfit(argument: &str, text: &str, usual: &str) -> Failure {
    let d = Diagnostic::error(format!("{argument} `{text}` can't be read"));
    Failure::Usage(d.help(format!("write it as {usual}")).into())
}

fn checked(argument: &str, text: &str, sound: Result<(), String>) -> Result<(), Failure> {
    sound.map_err(|why| Failure::Usage(Diagnostic::error(format!("{argument} `{text}`: {why}")).into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(args: AdditionArgs) -> Result<Additions, String> {
        args.additions().map_err(|f| lightgraph::Faults::from(f).to_string())
    }

    #[test]
    fn every_argument_is_read() {
        let found = said(AdditionArgs {
            sun: vec!["135,40,3".into()],
            light: vec!["point:1,2,3,10".into(), "spot:0,3,0,0,0,0,100,60".into()],
            environment: Some("sky:4".into()),
            camera_at: Some("0,1,4".into()),
            look_at: Some("0,1,0".into()),
            ..AdditionArgs::default()
        });
        let found = found.unwrap();
        assert_eq!(found.lights[0].1, AddedLight::Sun { azimuth: 135.0, elevation: 40.0, lux: 3.0, color: [1.0; 3] });
        assert_eq!(found.lights.len(), 3);
        assert_eq!(found.cameras[0].1, AddedCamera { at: [0.0, 1.0, 4.0], look_at: Some([0.0, 1.0, 0.0]), fov: 50.0 });
        assert!(matches!(found.environment, Some(AddedEnvironment::Sky { turbidity: 4.0, .. })));
        for (text, radiance) in [("2", [1.0; 3]), ("1,2,3", [0.5, 1.0, 1.5])] {
            let args = AdditionArgs {
                environment: Some(text.into()),
                environment_strength: Some(0.5),
                ..AdditionArgs::default()
            };
            assert_eq!(said(args).unwrap().environment, Some(AddedEnvironment::Constant { radiance }));
        }
    }

    #[test]
    fn what_cannot_be_read_names_the_argument_and_a_usual_one() {
        let sun = |text: &str| said(AdditionArgs { sun: vec![text.into()], ..AdditionArgs::default() }).unwrap_err();
        assert!(sun("1,2").contains("--sun `1,2` can't be read") && sun("1,2").contains("135,40,3"), "{}", sun("1,2"));
        assert!(sun("0,95,1").contains("elevation from -90 to 90"), "{}", sun("0,95,1"));
        let light =
            |text: &str| said(AdditionArgs { light: vec![text.into()], ..AdditionArgs::default() }).unwrap_err();
        assert!(light("lamp:1").contains("point:0,2,0,10"));
        assert!(light("point:0,0,0,-1").contains("not negative"));
        let environment =
            |text: &str| said(AdditionArgs { environment: Some(text.into()), ..AdditionArgs::default() }).unwrap_err();
        assert!(environment("skyline").contains("can't be read"));
        assert!(environment("sky:40").contains("turbidity 40"));
        assert!(environment("NaN").contains("can't be read"));
    }
}
