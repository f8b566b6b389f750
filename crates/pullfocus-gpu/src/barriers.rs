//! WGSL's rule for barriers, which `naga` does not enforce and other compilers do: all threads of a workgroup must come to one
//! together, and a compiler must see that they do. What comes out of an atomic, or out of memory that is written, never
//! counts as the same for all; `workgroupUniformLoad` does.

use std::collections::{HashMap, HashSet};
use wgpu::naga::{
    AddressSpace, Binding, Block, BuiltIn, Expression, Function, Handle, LocalVariable, Module, Statement,
    StorageAccess, front,
};

/// # Errors
/// The function that has a barrier where a compiler cannot know that all threads meet.
pub fn check(source: &str) -> Result<(), String> {
    let module = front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut known = HashMap::new();
    for entry in &module.entry_points {
        let same = |binding: &Option<Binding>| {
            matches!(binding, Some(Binding::BuiltIn(BuiltIn::WorkGroupId | BuiltIn::NumWorkGroups)))
        };
        let arguments = entry.function.arguments.iter().map(|argument| !same(&argument.binding)).collect();
        let found = Walk::new(&module, &entry.function, arguments, &mut known).run(false);
        if let Some(name) = found.apart {
            return Err(format!("threads may come apart before a barrier of {name}"));
        }
    }
    Ok(())
}

/// What is known of a call.
#[derive(Debug, Clone, Default)]
struct Found {
    /// Whether the result may differ from thread to thread.
    varies: bool,
    /// Who has a barrier to which threads may not come together.
    apart: Option<String>,
}

type Known = HashMap<(Handle<Function>, Vec<bool>, bool), Found>;

/// Where threads part: out of the function, or out of a loop's round.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Parted {
    function: bool,
    round: bool,
}

struct Walk<'a> {
    module: &'a Module,
    function: &'a Function,
    /// Which arguments, locals and calls' results may differ from thread to thread.
    arguments: Vec<bool>,
    locals: HashSet<Handle<LocalVariable>>,
    calls: HashSet<Handle<Expression>>,
    memo: HashMap<Handle<Expression>, bool>,
    known: &'a mut Known,
    found: Found,
}

impl<'a> Walk<'a> {
    fn new(module: &'a Module, function: &'a Function, arguments: Vec<bool>, known: &'a mut Known) -> Self {
        let (locals, calls, memo, found) = Default::default();
        Self { module, function, arguments, locals, calls, memo, known, found }
    }

    /// Until nothing new is found; `apart`: whether the call itself is made by some threads alone.
    fn run(mut self, apart: bool) -> Found {
        loop {
            let before = self.locals.len() + self.calls.len();
            self.memo.clear();
            self.block(&self.function.body, apart);
            if self.locals.len() + self.calls.len() == before {
                return self.found;
            }
        }
    }

    fn block(&mut self, block: &Block, mut apart: bool) -> Parted {
        let mut all = Parted::default();
        for statement in block {
            let parted = self.statement(statement, apart);
            apart |= parted != Parted::default();
            all = Parted { function: all.function | parted.function, round: all.round | parted.round };
        }
        all
    }

    fn statement(&mut self, statement: &Statement, apart: bool) -> Parted {
        let mut parted = Parted::default();
        match statement {
            Statement::Block(block) => parted = self.block(block, apart),
            Statement::If { condition, accept, reject } => {
                let apart = apart || self.varies(*condition);
                for block in [accept, reject] {
                    let one = self.block(block, apart);
                    parted =
                        Parted { function: parted.function | one.function, round: parted.round | one.round };
                }
            }
            Statement::Switch { selector, cases } => {
                let apart = apart || self.varies(*selector);
                for case in cases {
                    let one = self.block(&case.body, apart);
                    parted =
                        Parted { function: parted.function | one.function, round: parted.round | one.round };
                }
            }
            Statement::Loop { body, continuing, break_if } => {
                let round = |walk: &mut Self, apart| {
                    let body = walk.block(body, apart);
                    walk.block(continuing, apart || body != Parted::default());
                    let ends = break_if.is_some_and(|condition| walk.varies(condition));
                    Parted { function: body.function, round: body.round || ends }
                };
                parted = round(self, apart);
                if parted != Parted::default() {
                    // The next round begins with some of the threads.
                    round(self, true);
                }
                parted.round = false;
            }
            Statement::Break | Statement::Continue => parted.round = apart,
            Statement::Return { value } => {
                parted.function = apart;
                self.found.varies |= apart || value.is_some_and(|value| self.varies(value));
            }
            Statement::ControlBarrier(_) | Statement::WorkGroupUniformLoad { .. } if apart => {
                self.found.apart = Some(self.function.name.clone().unwrap_or_else(|| "main".into()));
            }
            Statement::Store { pointer, value } => {
                let (root, differs) = self.root(*pointer);
                if let Expression::LocalVariable(local) = self.function.expressions[root]
                    && (apart || differs || self.varies(*value))
                {
                    self.locals.insert(local);
                }
            }
            Statement::Call { function, arguments, result } => {
                let varies: Vec<bool> = arguments.iter().map(|&argument| self.varies(argument)).collect();
                for &argument in arguments {
                    // What is given by its address may be written there.
                    if let Expression::LocalVariable(local) = self.function.expressions[self.root(argument).0]
                    {
                        self.locals.insert(local);
                    }
                }
                let found = self.call(*function, varies, apart);
                if let Some(result) = result.filter(|_| found.varies) {
                    self.calls.insert(result);
                }
                self.found.apart = found.apart.or(self.found.apart.take());
            }
            _ => {}
        }
        parted
    }

    fn call(&mut self, function: Handle<Function>, varies: Vec<bool>, apart: bool) -> Found {
        let key = (function, varies, apart);
        if let Some(found) = self.known.get(&key) {
            return found.clone();
        }
        let body = &self.module.functions[function];
        let found = Walk::new(self.module, body, key.1.clone(), self.known).run(apart);
        self.known.insert(key, found.clone());
        found
    }

    /// What a pointer points into, and whether an index on the way differs.
    fn root(&mut self, pointer: Handle<Expression>) -> (Handle<Expression>, bool) {
        match self.function.expressions[pointer] {
            Expression::Access { base, index } => {
                let (root, differs) = self.root(base);
                (root, differs || self.varies(index))
            }
            Expression::AccessIndex { base, .. } => self.root(base),
            _ => (pointer, false),
        }
    }

    fn varies(&mut self, expression: Handle<Expression>) -> bool {
        if let Some(&known) = self.memo.get(&expression) {
            return known;
        }
        let varies = self.finds_varying(expression);
        self.memo.insert(expression, varies);
        varies
    }

    fn finds_varying(&mut self, expression: Handle<Expression>) -> bool {
        use Expression as E;
        let function = self.function;
        let mut any = |all: &[Handle<E>]| all.iter().any(|&one| self.varies(one));
        match &function.expressions[expression] {
            E::Literal(_) | E::Constant(_) | E::Override(_) | E::ZeroValue(_) | E::ArrayLength(_) => false,
            E::GlobalVariable(_) | E::LocalVariable(_) | E::WorkGroupUniformLoadResult { .. } => false,
            E::FunctionArgument(number) => self.arguments[*number as usize],
            E::CallResult(_) => self.calls.contains(&expression),
            E::Load { pointer } => {
                let (root, differs) = self.root(*pointer);
                differs
                    || match function.expressions[root] {
                        E::LocalVariable(local) => self.locals.contains(&local),
                        E::GlobalVariable(global) => match self.module.global_variables[global].space {
                            AddressSpace::Uniform => false,
                            AddressSpace::Storage { access } => access.contains(StorageAccess::STORE),
                            _ => true,
                        },
                        _ => true,
                    }
            }
            E::Compose { components, .. } => any(components),
            E::Access { base, index } => any(&[*base, *index]),
            E::AccessIndex { base, .. } => any(&[*base]),
            E::Splat { value, .. } => any(&[*value]),
            E::Swizzle { vector, .. } => any(&[*vector]),
            E::Unary { expr, .. } | E::As { expr, .. } => any(&[*expr]),
            E::Binary { left, right, .. } => any(&[*left, *right]),
            E::Select { condition, accept, reject } => any(&[*condition, *accept, *reject]),
            E::Relational { argument, .. } => any(&[*argument]),
            E::Math { arg, arg1, arg2, arg3, .. } => {
                any(&[*arg]) || [arg1, arg2, arg3].into_iter().flatten().any(|&one| any(&[one]))
            }
            // Atomics, textures, and what these shaders do not have.
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::check;

    /// A shader around a body.
    fn shader(body: &str) -> String {
        format!(
            "@group(0) @binding(0) var<storage, read> given: array<u32>;
             @group(0) @binding(1) var<storage, read_write> written: array<u32>;
             var<workgroup> bits: atomic<u32>;
             var<workgroup> copy: u32;
             fn meet() {{ workgroupBarrier(); }}
             @compute @workgroup_size(64)
             fn main(@builtin(local_invocation_index) index: u32, @builtin(workgroup_id) group: vec3u) {{ {body} }}"
        )
    }

    #[test]
    fn barriers_that_all_threads_reach_are_told_from_others() {
        for body in [
            "if given[group.x] > 0u { workgroupBarrier(); }",
            "for (var i = 0u; i < given[0]; i++) { meet(); }",
            "if index == 0u { copy = atomicLoad(&bits); }
             var left = workgroupUniformLoad(&copy);
             while left != 0u { left &= left - 1u; workgroupBarrier(); }",
            "workgroupBarrier(); if index > 3u { return; } written[index] = 1u;",
        ] {
            assert_eq!(check(&shader(body)), Ok(()), "{body}");
        }
        for body in [
            "if index > 3u { workgroupBarrier(); }",
            "if index > 3u { return; } meet();",
            "if written[0] > 0u { meet(); }",
            "var left = atomicLoad(&bits); while left != 0u { left &= left - 1u; workgroupBarrier(); }",
            "for (var i = 0u; i < 4u; i++) { workgroupBarrier(); if copy > i { break; } }",
            "var most = 0u; if index > 3u { most = 2u; } for (var i = 0u; i < most; i++) { meet(); }",
        ] {
            assert!(check(&shader(body)).is_err(), "{body}");
        }
    }
}
