//! Sparsity of the stiffness and the order in which its unknowns are eliminated.

use feral_metis::{MetisOptions, metis_order_full};

/// Vertices of a part that is ordered by minimum degree and dissected no further; with the library's 200 the factors of fingers
/// take 4 to 8 % more operations.
const LEAF_VERTICES: u32 = 60;

/// Lower triangle of a symmetric sparse matrix by columns; rows ascend within a column, the diagonal first.
#[derive(Clone, Debug, Default)]
pub struct Pattern {
    /// Start of each column, length n + 1.
    pub column_start: Vec<usize>,
    /// Row of each entry.
    pub row: Vec<usize>,
}

impl Pattern {
    /// Number of rows.
    pub fn size(&self) -> usize {
        self.column_start.len() - 1
    }

    /// Upper triangle of the same matrix by columns.
    pub fn transposed(&self) -> Self {
        let n = self.size();
        let mut column_start = vec![0; n + 1];
        for &row in &self.row {
            column_start[row + 1] += 1;
        }
        for k in 0..n {
            column_start[k + 1] += column_start[k];
        }
        let mut next = column_start.clone();
        let mut row = vec![0; self.row.len()];
        for column in 0..n {
            for &r in &self.row[self.column_start[column]..self.column_start[column + 1]] {
                row[next[r]] = column;
                next[r] += 1;
            }
        }
        Self { column_start, row }
    }
}

/// Nested-dissection elimination order of a graph, postordered so that supernodes are contiguous.
///
/// `neighbours[v]` lists the vertices adjacent to `v`, without `v`. Returns old vertex numbers in elimination
/// order. An empty graph gives an empty order.
pub fn elimination_order(neighbours: &[Vec<u32>]) -> Vec<usize> {
    let n = neighbours.len();
    if n == 0 {
        return Vec::new();
    }
    let mut start = vec![0i32];
    let mut rows = Vec::new();
    for (v, list) in neighbours.iter().enumerate() {
        let mut sorted: Vec<i32> = list.iter().map(|&w| w as i32).chain([v as i32]).collect();
        sorted.sort_unstable();
        sorted.dedup();
        rows.extend(sorted);
        start.push(rows.len() as i32);
    }
    let pattern = feral_metis::CscPattern::new(n, &start, &rows).expect("a symmetric pattern");
    let options = MetisOptions { nd_to_amd_switch: LEAF_VERTICES, ..Default::default() };
    let order: Vec<usize> = match metis_order_full(&pattern, &options) {
        Ok((order, ..)) => order.into_iter().map(|v| v as usize).collect(),
        // The order only decides how fast the factorisation is.
        Err(_) => (0..n).collect(),
    };
    postorder(neighbours, &order)
}

/// Rearranges `order` into a postorder of its elimination tree (Liu 1990), which leaves the fill unchanged.
fn postorder(neighbours: &[Vec<u32>], order: &[usize]) -> Vec<usize> {
    let n = order.len();
    let mut place = vec![0; n];
    for (k, &v) in order.iter().enumerate() {
        place[v] = k;
    }
    const NONE: usize = usize::MAX;
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for k in 0..n {
        for &w in &neighbours[order[k]] {
            let mut i = place[w as usize];
            while i < k {
                let next = std::mem::replace(&mut ancestor[i], k);
                if next == NONE {
                    parent[i] = k;
                    break;
                }
                i = next;
            }
        }
    }
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut stack: Vec<(usize, bool)> = Vec::new();
    for k in (0..n).rev() {
        match parent[k] {
            NONE => stack.push((k, false)),
            p => children[p].push(k),
        }
    }
    let mut result = Vec::with_capacity(n);
    while let Some((k, visited)) = stack.pop() {
        if visited {
            result.push(order[k]);
        } else {
            stack.push((k, true));
            stack.extend(children[k].iter().map(|&child| (child, false)));
        }
    }
    result
}
