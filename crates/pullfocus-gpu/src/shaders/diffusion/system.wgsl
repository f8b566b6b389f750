// A system in memory, for the solvers that go over it pass by pass: for unknown j of line i, at j * lines + i, its weight
// and its link to the unknown before.

struct Row {
    weight: Num,
    link: Num,
}
