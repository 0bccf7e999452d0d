//! Collision shapes as capsules that enclose them.

use super::document::read_origin;
use super::xml::{Xml, child};
use crate::error::Error;
use crate::pose::Pose;
use crate::robot::Capsule;
use nalgebra::Vector3;
use roxmltree::Node;

/// Capsules around the spheres, cylinders, boxes and capsules of a link, and the number of meshes left out.
pub(super) fn read_collisions(
    xml: &Xml,
    link: Node,
    place: &str,
) -> Result<(Vec<Capsule>, usize), Error> {
    let (mut capsules, mut n_meshes) = (Vec::new(), 0);
    let collisions = link.children().filter(|n| n.has_tag_name("collision"));
    for collision in collisions {
        let Some(shape) = child(collision, "geometry").and_then(|g| g.first_element_child()) else {
            continue;
        };
        let size = |name: &str| {
            xml.required(shape, name, place)?;
            let value = xml.number(shape, name, place)?.unwrap_or_default();
            if value > 0.0 {
                return Ok(value);
            }
            let rule = "a size is above zero, m; correct it, or leave the shape out";
            Err(xml.refuse(shape, place, &format!("{name} {value}"), rule))
        };
        let along = |axis: usize, length: f64, radius: f64| {
            let end = Vector3::ith(axis, 0.5 * length);
            Capsule {
                ends: [-end, end],
                radius,
            }
        };
        let capsule = match shape.tag_name().name() {
            "sphere" => along(2, 0.0, size("radius")?),
            "cylinder" | "capsule" => along(2, size("length")?, size("radius")?),
            "box" => {
                xml.required(shape, "size", place)?;
                let sides: [f64; 3] = xml.numbers(shape, "size", place)?.unwrap_or_default();
                if !sides.iter().all(|s| *s > 0.0) {
                    let rule = "the sides of a box are above zero, m";
                    return Err(xml.refuse(shape, place, &format!("size {sides:?}"), rule));
                }
                let longest = Vector3::from(sides).imax();
                let (a, b) = (sides[(longest + 1) % 3], sides[(longest + 2) % 3]);
                // Its ends lie in the middle of two faces, the corners just on the surface.
                along(longest, sides[longest], 0.5 * a.hypot(b))
            }
            _ => {
                n_meshes += 1;
                continue;
            }
        };
        let [xyz, rpy] = read_origin(xml, collision, place)?;
        capsules.push(capsule.expressed_in(&Pose::from_xyz_rpy(xyz, rpy)));
    }
    Ok((capsules, n_meshes))
}
