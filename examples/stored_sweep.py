"""How does the static strength depend on the correlation length, and how do I keep the results?

A study with a sweep, run into a folder. Run it again and it goes on where it ended, or finds that
nothing is missing; `stiction report RUN` makes a page of it. All points use the same samples.
"""

import stiction as st

problem = st.paper.problem(nodes=512)
study = st.Study(
    problem=problem,
    random=st.paper.strength(problem),
    method=st.LocalCriterion(),
    ensemble=st.Ensemble(samples=1000, seed=0),
    sweep=[{"random.strength.spectrum.correlation_length": [1.5e-3, 3e-3, 6e-3]}],
    title="Static strength against correlation length",
)
study.run(out="RUN", progress=False)

stored = st.open_run("RUN")  # tomorrow, or elsewhere
status = stored.status()
print(f"{stored.study.title}: {status.done} of {status.samples} samples")
result = stored.dataset()
for length in result.correlation_length.values:
    found = st.statistics.quantiles(
        result.critical_stress.sel(correlation_length=length), [0.05, 0.5, 0.95]
    )
    low, median, high = found.value / 1e6
    print(
        f"xi_0 = {length * 1e3:.2f} mm: {median:.3f} MPa, 5 to 95 %: {low:.3f} to {high:.3f} MPa"
    )
st.plot.quantiles(result)
