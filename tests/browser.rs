//! The report of a front in a browser: what is chosen in one place is chosen in all.

#[path = "common/headless.rs"]
mod headless;

use std::path::Path;

use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// What the page answers to the script, which ends with `tell(...)`.
fn answer(browser: &Path, folder: &Path, page: &str, script: &str) -> Value {
    let tell = "const tell = (value) => { const pre = document.createElement('pre'); pre.id = 'told'; \
                pre.textContent = JSON.stringify(value); document.body.append(pre); };";
    let file = folder.join("tested.html");
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
move(pictures[1], place(pictures[1], 3));
told.hovered = chosen();
pictures[1].dispatchEvent(new PointerEvent("pointerleave"));
told.left = chosen();
pictures[0].dispatchEvent(new MouseEvent("click", move(pictures[0], place(pictures[0], 1))));
pictures[0].dispatchEvent(new PointerEvent("pointerleave"));
told.clicked = chosen();
const heads = [...document.querySelectorAll("table.front thead button")];
const column = (i) => rows().map((row) => Number(row.cells[i].dataset.value));
heads[2].click();
told.ascending = column(2);
heads[2].click();
told.descending = column(2);
told.sort = document.querySelectorAll("table.front thead th")[2].getAttribute("aria-sort");
told.still = chosen();
tell(told);
"#;

#[test]
fn what_is_chosen_in_one_picture_is_chosen_in_all_and_in_the_table() {
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
    // Overshoot over settling time, three tuners, and at least one response.
    let pictures = told["pictures"].as_u64().unwrap();
    assert!(pictures >= 5, "{told}");
    assert!(told["rows"].as_u64().unwrap() >= 5, "{told}");
    assert!(told["responses"].as_u64() >= told["rows"].as_u64(), "{told}");
    let everywhere = |point: &str| serde_json::json!({ "points": [point], "pictures": pictures, "rows": 1 });
    let nowhere = serde_json::json!({ "points": [], "pictures": 0, "rows": 0 });
    assert_eq!(told["keys"], everywhere("1"), "two steps to the right lead to the second row");
    assert_eq!(told["escaped"], nowhere);
    assert_eq!(told["hovered"], everywhere("3"));
    assert_eq!(told["left"], nowhere, "what is hovered over is not kept");
    assert_eq!(told["clicked"], everywhere("1"), "what is clicked is kept");
    let numbers = |key: &str| told[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    assert!(numbers("ascending").is_sorted(), "{told}");
    assert!(numbers("descending").iter().rev().is_sorted(), "{told}");
    assert_eq!(told["sort"], "descending");
    assert_eq!(told["still"], everywhere("1"), "sorting keeps the choice");
}
