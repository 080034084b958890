//! Reports in a browser: linked selection of front points, rotation, sorting of tables, by pointer and by keyboard, without
//! errors on the console.

#[path = "common/headless.rs"]
mod headless;

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// Runs a script, which ends with `tell(...)`, in the page; returns its answer.
fn answer(browser: &Path, folder: &Path, page: &str, script: &str) -> Value {
    let tell = "const tell = (value) => { const pre = document.createElement('pre'); pre.id = 'told'; \
                pre.textContent = JSON.stringify(value); document.body.append(pre); };";
    let listen = "const problems = []; console.error = console.warn = (...all) => problems.push(all.join(' ')); \
                  window.addEventListener('error', (event) => problems.push(event.message));";
    let file = folder.join("tested.html");
    let page = page.replacen("<head>", &format!("<head><script>{listen}</script>"), 1);
    std::fs::write(&file, page.replace("</body>", &format!("<script>{tell}\n{script}</script></body>"))).unwrap();
    let output = headless::dump(browser, folder, &format!("file://{}", file.display()), &["--window-size=1100,1600"]);
    let dom = String::from_utf8_lossy(&output.stdout);
    let told = dom.split_once("<pre id=\"told\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let (told, _) = told.unwrap_or_else(|| panic!("no answer: {}", String::from_utf8_lossy(&output.stderr)));
    serde_json::from_str(&told.replace("&quot;", "\"").replace("&amp;", "&")).unwrap()
}

const SCRIPT: &str = r#"
const rows = () => [...document.querySelectorAll("table.front tbody tr")];
const pictures = [...document.querySelectorAll("svg.plot")].filter((svg) => svg.querySelector("[data-point]"));
const dotted = pictures.filter((svg) => svg.querySelector("g.dot"));
const chosen = () => ({
  points: [...new Set([...document.querySelectorAll(".chosen")].map((e) => e.dataset.point))],
  pictures: pictures.filter((svg) => svg.querySelector(".chosen")).length,
  rows: rows().filter((row) => row.classList.contains("chosen")).length,
});
const key = (target, name) => target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
const move = (svg, [x, y]) => {
  const box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
  const at = { clientX: box.left + x * scale, clientY: box.top + y * scale, bubbles: true };
  svg.dispatchEvent(new PointerEvent("pointermove", at));
  return at;
};
const place = (svg, point) =>
  svg.querySelector(`g.dot[data-point="${point}"] path`).getAttribute("d").slice(1).split(/[ h]/).slice(0, 2).map(Number);
const told = { pictures: pictures.length, rows: rows().length, responses: document.querySelectorAll("g.line[data-point]").length };
key(pictures[0], "ArrowRight");
key(pictures[0], "ArrowRight");
told.keys = chosen();
key(pictures[0], "Escape");
told.escaped = chosen();
move(dotted[1], place(dotted[1], 3));
told.hovered = chosen();
dotted[1].dispatchEvent(new PointerEvent("pointerleave"));
told.left = chosen();
dotted[0].dispatchEvent(new MouseEvent("click", move(dotted[0], place(dotted[0], 1))));
dotted[0].dispatchEvent(new PointerEvent("pointerleave"));
told.clicked = chosen();
const heads = [...document.querySelectorAll("table.front thead button")];
const column = (i) => rows().map((row) => Number(row.cells[i].dataset.value));
heads[2].click();
told.ascending = column(2);
heads[2].click();
told.descending = column(2);
told.sort = document.querySelectorAll("table.front thead th")[2].getAttribute("aria-sort");
told.still = chosen();
const line = document.querySelector("g.line[data-point='2'] path");
line.dispatchEvent(new PointerEvent("pointermove", { clientX: -100, clientY: -100, bubbles: true }));
told.line = chosen();
told.problems = problems;
tell(told);
"#;

#[test]
fn a_point_selected_in_one_plot_is_selected_in_all_plots_and_in_the_table() {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut run = cargo_bin_cmd!("mops");
    run.args(["pareto", "pid-pareto", "--points", "5", "--quiet", "--out", out.to_str().unwrap()]).assert().success();
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!page.contains("src=\"http") && !page.contains("@import"), "the page needs no network");
    let told = answer(&browser, folder.path(), &page, SCRIPT);
    // Overshoot over settling time, parallel coordinates, three tuners, and at least one response.
    let pictures = told["pictures"].as_u64().unwrap();
    assert!(pictures >= 6, "{told}");
    assert!(told["rows"].as_u64().unwrap() >= 5, "{told}");
    assert!(told["responses"].as_u64() >= told["rows"].as_u64(), "{told}");
    let everywhere = |point: &str| serde_json::json!({ "points": [point], "pictures": pictures, "rows": 1 });
    let nowhere = serde_json::json!({ "points": [], "pictures": 0, "rows": 0 });
    assert_eq!(told["keys"], everywhere("1"), "two steps to the right select the second row");
    assert_eq!(told["escaped"], nowhere);
    assert_eq!(told["hovered"], everywhere("3"));
    assert_eq!(told["left"], nowhere, "hovering selects only temporarily");
    assert_eq!(told["clicked"], everywhere("1"), "a click selects permanently");
    let numbers = |key: &str| told[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    assert!(numbers("ascending").is_sorted(), "{told}");
    assert!(numbers("descending").iter().rev().is_sorted(), "{told}");
    assert_eq!(told["sort"], "descending");
    assert_eq!(told["still"], everywhere("1"), "sorting keeps the selection");
    assert_eq!(told["line"], everywhere("2"), "touching a line selects it");
    assert_eq!(told["problems"], serde_json::json!([]));
}

const TURNED: &str = r#"
const svg = document.querySelector("svg[data-view]");
const key = (target, name, shiftKey) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key: name, shiftKey, bubbles: true, cancelable: true }));
const place = (point) =>
  svg.querySelector(`g.dot[data-point="${point}"] path`).getAttribute("d").slice(1).split(/[ h]/).slice(0, 2).map(Number);
const all = () => [...svg.querySelectorAll("g[data-space] > path, g[data-space] > text")].map((shape) => shape.outerHTML);
const chosen = () => [...new Set([...document.querySelectorAll(".chosen")].map((e) => e.dataset.point))];
const told = { dots: svg.querySelectorAll("g.dot").length, rows: document.querySelectorAll("table.front tbody tr").length };
const [before, drawn] = [place(0), all()];
key(svg, "ArrowRight", true);
told.turned = { moved: place(0)[0] !== before[0], shapes: all().filter((shape, i) => shape !== drawn[i]).length, chosen: chosen() };
key(svg, "ArrowLeft", true);
told.back = Math.hypot(place(0)[0] - before[0], place(0)[1] - before[1]);
const drag = (kind, x, y, buttons) =>
  svg.dispatchEvent(new PointerEvent(kind, { clientX: x, clientY: y, buttons, bubbles: true }));
drag("pointerdown", 300, 300, 1);
drag("pointermove", 360, 320, 1);
drag("pointerup", 360, 320, 0);
svg.dispatchEvent(new MouseEvent("click", { clientX: 360, clientY: 320, bubbles: true }));
told.dragged = { moved: place(0)[0] !== before[0], kept: document.querySelectorAll("[aria-selected='true']").length };
key(svg, "Escape", false);
key(svg, "ArrowRight", false);
told.stepped = { chosen: chosen(), dots: svg.querySelectorAll("g.dot.chosen").length > 0 };
// Another table of the page, by keyboard alone: its headers are buttons.
const criteria = [...document.querySelectorAll("table")].find((table) => table.tHead.textContent.startsWith("criterion"));
const names = () => [...criteria.tBodies[0].rows].map((row) => row.cells[0].textContent);
const head = criteria.querySelector("thead button");
head.focus();
told.focused = document.activeElement === head;
head.click();
told.names = names();
told.problems = problems;
tell(told);
"#;

#[test]
fn a_three_dimensional_front_rotates_by_keys_and_by_dragging_and_other_tables_sort_too() {
    let Some(browser) = headless::browser() else {
        eprintln!("{}", headless::SKIPPED);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let third = r#"criteria.error={itae={signal="y",target=1.0},usage="minimise",demand=10}"#;
    let mut run = cargo_bin_cmd!("mops");
    run.args(["pareto", "pid-pareto", "--points", "3", "--max-evaluations", "600", "--quiet", "--set", third]);
    run.args(["--out", out.to_str().unwrap()]).assert().success();
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    let told = answer(&browser, folder.path(), &page, TURNED);
    // One dot per point, and one of another colour on the point nearest to the demands.
    assert!(told["rows"].as_u64().unwrap() >= 3 && told["dots"].as_u64() > told["rows"].as_u64(), "{told}");
    assert_eq!(told["turned"]["moved"], true, "{told}");
    assert!(told["turned"]["shapes"].as_u64().unwrap() > 20, "edges, numbers and names rotate as well: {told}");
    assert_eq!(told["turned"]["chosen"], serde_json::json!([]), "rotation selects nothing");
    assert!(told["back"].as_f64().unwrap() < 0.15, "{told}");
    assert_eq!(told["dragged"], serde_json::json!({ "moved": true, "kept": 0 }), "the end of a drag is not a click");
    assert_eq!(told["stepped"], serde_json::json!({ "chosen": ["0"], "dots": true }));
    assert_eq!(told["focused"], true);
    assert_eq!(told["names"], serde_json::json!(["error", "overshoot", "settling"]));
    assert_eq!(told["problems"], serde_json::json!([]));
}
