//! The page of `lightgraph test --report` in a real browser: every image decodes, the slider and the flicker button do
//! what they say.

use crate::browser::visited;
use crate::device;
use crate::support::{Scratch, repository};
use lightgraph_cli::snapshot::{Bless, TestOptions, find, report, run};
use std::fs;

const GRAPH: &str = r#"Graph(
    about: "One colour.",
    params: {"red": Float(default: 0.1, about: "red")},
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "fill", shader: "fill.wgsl")],
    outputs: {"color": "color"},
)"#;

const SHADER: &str = "var<uniform> red: f32;
struct Image { @location(0) color: vec4f }
@fragment fn fragment() -> Image { return Image(vec4f(red, 0.0, 0.0, 1.0)); }
";

/// Does what a visitor does, and writes down what is to be seen.
const VISITOR: &str = r#"<script>
window.addEventListener("load", async () => {
  const seen = [];
  const pair = document.querySelector(".pair");
  const [slider, button] = [pair.querySelector("input"), pair.querySelector("button")];
  const [below, over] = pair.querySelectorAll("img");
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const red = (image) => {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, 1, 1).data[0];
  };
  seen.push(`images ${[...document.images].map((i) => `${i.naturalWidth}x${i.naturalHeight}`)}`);
  seen.push(`actual is redder: ${red(over) > red(below)}`);
  const [a, b] = [over.getBoundingClientRect(), below.getBoundingClientRect()];
  seen.push(`one over the other: ${a.left === b.left && a.top === b.top && a.width === b.width && a.height === b.height && a.width > 99}`);
  const at = (share) => document.elementFromPoint(a.left + share * a.width, a.top + a.height / 2) === over ? "actual" : "expected";
  const look = () => [at(0.1), at(0.4), at(0.6), at(0.9)].join(" ");
  const slide = (to) => { slider.value = to; slider.dispatchEvent(new Event("input", { bubbles: true })); return look(); };
  window.scrollTo(0, 0);
  seen.push(`start: ${look()}`, `slid to 0: ${slide(0)}`, `slid to 75: ${slide(75)}`, `slid to 100: ${slide(100)}`);
  slide(50);
  button.click();
  const flickers = [];
  for (let i = 0; i < 4; i++) { await wait(400); flickers.push(at(0.25) === at(0.75) ? at(0.25) : "both"); }
  seen.push(`flickers: ${flickers.filter((f, i) => i > 0 && f !== flickers[i - 1]).length > 1 && !flickers.includes("both")}`);
  seen.push(`the button says ${button.textContent}`);
  button.click();
  seen.push(`stopped: ${look()}`, `the button says ${button.textContent}`);
  const out = document.createElement("pre");
  out.id = "seen";
  out.textContent = seen.join("\n");
  document.body.append(out);
});
</script>
"#;

#[test]
fn the_page_works_in_a_browser() {
    let scratch = Scratch::new("report-page");
    let at = |file: &str| scratch.path().join(file);
    fs::create_dir_all(at("tests")).unwrap();
    fs::create_dir_all(at("shaders")).unwrap();
    fs::write(at("fill.ron"), GRAPH).unwrap();
    fs::write(at("shaders/fill.wgsl"), SHADER).unwrap();
    fs::copy(repository("scenes/lambert_plane.glb"), at("plane.glb")).unwrap();
    let test = "Test(about: \"Red.\", graph: \"../fill.ron\", scene: \"../plane.glb\", size: (16, 8), checks: [\
                Image(output: \"color\", max: 0, reason: \"exact\")])";
    fs::write(at("tests/red.ron"), test).unwrap();
    let tests = find(&[at("tests")]).unwrap_or_else(|f| panic!("{f}"));
    let summary = {
        let _alone = device::gpu();
        let options = |bless| TestOptions { bless, failures: at("out"), ..TestOptions::default() };
        run(&tests, &options(Bless::All), &mut |_| ());
        fs::write(at("fill.ron"), GRAPH.replace("0.1", "0.8")).unwrap();
        run(&tests, &options(Bless::None), &mut |_| ())
    };
    let page = report::html(&summary).unwrap_or_else(|f| panic!("{f}"));
    fs::write(at("page.html"), page + VISITOR).unwrap();
    let document = visited(&at("page.html"), &at("browser"));
    let seen = document.split("<pre id=\"seen\">").nth(1).and_then(|t| t.split("</pre>").next());
    let seen = seen.unwrap_or_else(|| panic!("the visitor did not get to the end:\n{document}"));
    let expected = "images 16x8,16x8,16x8,16x8,16x8
actual is redder: true
one over the other: true
start: actual actual expected expected
slid to 0: expected expected expected expected
slid to 75: actual actual actual expected
slid to 100: actual actual actual actual
flickers: true
the button says stop
stopped: actual actual expected expected
the button says flicker";
    assert_eq!(seen, expected);
}
