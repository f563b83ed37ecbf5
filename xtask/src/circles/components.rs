//! Strongly connected components of a graph, by Tarjan's algorithm.

use std::collections::BTreeMap;

/// A dependency of one module on another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    pub line: usize,
    /// The path that leads there.
    pub name: String,
}

/// Modules each of which depends on all others, directly or indirectly.
#[derive(Debug, PartialEq, Eq)]
pub struct Component {
    pub modules: Vec<usize>,
    /// The first of the edges between each two of them.
    pub edges: Vec<Edge>,
}

/// The components of more than one module.
pub fn circles(modules: usize, edges: &[Edge]) -> Vec<Component> {
    let mut search = Search::new(modules, edges);
    for module in 0..modules {
        if !search.order.contains_key(&module) {
            search.visit(module);
        }
    }
    search
        .components
        .into_iter()
        .filter(|modules| modules.len() > 1)
        .map(|mut modules| {
            modules.sort_unstable();
            let mut first: BTreeMap<(usize, usize), &Edge> = BTreeMap::new();
            for edge in edges {
                if modules.contains(&edge.from) && modules.contains(&edge.to) {
                    first.entry((edge.from, edge.to)).or_insert(edge);
                }
            }
            Component { modules, edges: first.into_values().cloned().collect() }
        })
        .collect()
}

struct Search {
    successors: BTreeMap<usize, Vec<usize>>,
    /// When each module was first visited.
    order: BTreeMap<usize, usize>,
    /// The earliest module on the stack that each module reaches.
    lowest: BTreeMap<usize, usize>,
    stack: Vec<usize>,
    components: Vec<Vec<usize>>,
}

impl Search {
    fn new(modules: usize, edges: &[Edge]) -> Self {
        let mut successors: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for edge in edges.iter().filter(|edge| edge.from != edge.to) {
            successors.entry(edge.from).or_default().push(edge.to);
        }
        let stack = Vec::with_capacity(modules);
        let (order, lowest, components) = Default::default();
        Self { successors, order, lowest, stack, components }
    }

    fn visit(&mut self, module: usize) {
        let index = self.order.len();
        self.order.insert(module, index);
        self.lowest.insert(module, index);
        self.stack.push(module);
        for next in self.successors.get(&module).cloned().unwrap_or_default() {
            let reached = if !self.order.contains_key(&next) {
                self.visit(next);
                self.lowest.get(&next).copied()
            } else if self.stack.contains(&next) {
                self.order.get(&next).copied()
            } else {
                None
            };
            if let (Some(reached), Some(lowest)) = (reached, self.lowest.get_mut(&module)) {
                *lowest = reached.min(*lowest);
            }
        }
        if self.lowest.get(&module) == Some(&index) {
            let start = self.stack.iter().position(|&other| other == module);
            self.components.push(self.stack.split_off(start.unwrap_or_default()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: usize, to: usize, line: usize) -> Edge {
        Edge { from, to, line, name: String::new() }
    }

    #[test]
    fn an_acyclic_graph_has_no_circles() {
        assert!(circles(3, &[edge(0, 1, 1), edge(0, 2, 2), edge(1, 2, 3)]).is_empty());
    }

    #[test]
    fn each_circle_is_found_with_one_edge_for_each_pair() {
        let edges = [
            edge(0, 1, 1),
            edge(1, 2, 2),
            edge(2, 1, 3),
            edge(1, 2, 9),
            edge(3, 4, 4),
            edge(4, 3, 5),
        ];
        let found = circles(5, &edges);
        assert_eq!(
            found,
            [
                Component { modules: vec![1, 2], edges: vec![edge(1, 2, 2), edge(2, 1, 3)] },
                Component { modules: vec![3, 4], edges: vec![edge(3, 4, 4), edge(4, 3, 5)] },
            ]
        );
    }

    #[test]
    fn a_circle_through_all_is_one_component() {
        let found = circles(3, &[edge(0, 1, 1), edge(1, 2, 1), edge(2, 0, 1)]);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].modules, [0, 1, 2]);
    }
}
