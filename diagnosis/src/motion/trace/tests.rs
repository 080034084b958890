use super::between;

#[test]
fn a_sensor_of_another_rate_is_read_along_straight_lines_and_keeps_its_ends() {
    let (times, values) = ([0.0, 0.5, 2.0], [1.0, 2.0, -1.0]);
    let read = [-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 3.0].map(|t| between(&times, &values, t));
    assert_eq!(read, [1.0, 1.0, 1.5, 2.0, 1.0, -1.0, -1.0]);
}
