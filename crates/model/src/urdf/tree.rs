//! One tree from a list of links and joints, or the reason why there is none.

use super::document::{Description, UrdfJoint};
use crate::error::Error;
use crate::suggestion::did_you_mean;
use std::collections::HashMap;

/// The joints depth first from the root, children in document order, parents first.
pub(super) struct Tree {
    /// Index of the root link.
    pub(super) root: usize,
    /// Joint, the link it carries, and the place in this list of the joint that carries its parent link.
    pub(super) order: Vec<Branch>,
}

pub(super) struct Branch {
    pub(super) joint: usize,
    pub(super) link: usize,
    pub(super) parent: Option<usize>,
}

pub(super) fn tree(description: &Description) -> Result<Tree, Error> {
    let links = unique_links(description)?;
    unique_joints(description)?;
    let mut carrier: Vec<Option<usize>> = vec![None; description.links.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); description.links.len()];
    for (j, joint) in description.joints.iter().enumerate() {
        let parent = link_named(&links, &joint.parent, joint, "parent")?;
        let child = link_named(&links, &joint.child, joint, "child")?;
        if let Some(other) = carrier[child] {
            let other = &description.joints[other];
            let met = format!("link {} is the child of two joints", joint.child);
            let rule = format!(
                "the other is joint {} on line {}; keep one: a loop cannot be described",
                other.name, other.line
            );
            return Err(refuse(joint, &met, &rule));
        }
        carrier[child] = Some(j);
        children[parent].push(j);
    }
    let root = only_root(description, &carrier)?;
    let mut order: Vec<Branch> = Vec::with_capacity(description.joints.len());
    let mut open: Vec<(usize, Option<usize>)> =
        children[root].iter().rev().map(|&j| (j, None)).collect();
    while let Some((joint, parent)) = open.pop() {
        let link = links[description.joints[joint].child.as_str()];
        let here = order.len();
        order.push(Branch {
            joint,
            link,
            parent,
        });
        open.extend(children[link].iter().rev().map(|&j| (j, Some(here))));
    }
    if order.len() < description.joints.len() {
        let mut reached = vec![false; description.joints.len()];
        for branch in &order {
            reached[branch.joint] = true;
        }
        let lost: Vec<&UrdfJoint> = description
            .joints
            .iter()
            .zip(&reached)
            .filter(|(_, r)| !**r)
            .map(|(j, _)| j)
            .collect();
        let lines: Vec<String> = lost
            .iter()
            .map(|j| format!("{} (line {})", j.name, j.line))
            .collect();
        let met = format!(
            "a loop of joints that the root does not reach: {}",
            lines.join(", ")
        );
        return Err(refuse(
            lost[0],
            &met,
            "cut the loop: each link has one parent",
        ));
    }
    Ok(Tree { root, order })
}

fn refuse(joint: &UrdfJoint, met: &str, rule: &str) -> Error {
    Error::robot(format!("joint {}", joint.name), met, rule).at(joint.line, joint.column)
}

fn unique_links(description: &Description) -> Result<HashMap<&str, usize>, Error> {
    let mut links = HashMap::new();
    for (k, link) in description.links.iter().enumerate() {
        if let Some(other) = links.insert(link.name.as_str(), k) {
            let met = format!(
                "name used twice, first on line {}",
                description.links[other].line
            );
            let error = Error::robot(format!("link {}", link.name), met, "rename one of them");
            return Err(error.at(link.line, link.column));
        }
    }
    Ok(links)
}

fn unique_joints(description: &Description) -> Result<(), Error> {
    let mut joints = HashMap::new();
    for joint in &description.joints {
        if let Some(line) = joints.insert(joint.name.as_str(), joint.line) {
            let met = format!("name used twice, first on line {line}");
            return Err(refuse(joint, &met, "rename one of them"));
        }
    }
    Ok(())
}

fn link_named(
    links: &HashMap<&str, usize>,
    name: &str,
    joint: &UrdfJoint,
    role: &str,
) -> Result<usize, Error> {
    links.get(name).copied().ok_or_else(|| {
        let mut names: Vec<&str> = links.keys().copied().collect();
        names.sort_unstable();
        refuse(
            joint,
            &format!("{role} link {name:?} is not in the file"),
            &did_you_mean(name, names),
        )
    })
}

/// The one link that no joint carries.
fn only_root(description: &Description, carrier: &[Option<usize>]) -> Result<usize, Error> {
    let roots: Vec<usize> = (0..carrier.len())
        .filter(|&k| carrier[k].is_none())
        .collect();
    match *roots.as_slice() {
        [root] => Ok(root),
        [first, second, ..] => {
            let (a, b) = (&description.links[first], &description.links[second]);
            let met = format!(
                "two parts that are not connected: link {} on line {} has no parent either",
                a.name, a.line
            );
            let rule = "connect it with a joint, or remove it";
            Err(Error::robot(format!("link {}", b.name), met, rule).at(b.line, b.column))
        }
        [] => {
            let Some(joint) = description.joints.first() else {
                return Err(
                    Error::robot("file", "no link", "a robot needs links and joints").at(1, 1),
                );
            };
            let met = "every link is the child of a joint: a loop, without a root";
            Err(refuse(joint, met, "cut the loop: one link has no parent"))
        }
    }
}
