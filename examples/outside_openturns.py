"""How likely is sliding below a stress, by a reliability code of others (OpenTURNS)?

`st.external.limit_state` is a function of standard normal draws, which is all that such codes
ask for.
"""

import numpy as np
import openturns as ot

import stiction as st

problem = st.paper.problem(nodes=512)
strength = st.paper.strength(problem, correlation_ratio=2.0)
stress = 0.662e6  # Pa
method = st.LocalCriterion()

limit_state = st.external.limit_state(problem, strength, method)
function = ot.PythonFunction(
    limit_state.dimension, 1, func_sample=lambda draws: limit_state(np.array(draws))[:, None]
)
draws = ot.RandomVector(ot.Normal(limit_state.dimension))
failure = ot.ThresholdEvent(ot.CompositeRandomVector(function, draws), ot.Less(), stress)

ot.RandomGenerator.SetSeed(1)
subset = ot.SubsetSampling(failure, 0.5, 0.1)  # proposal range, conditional probability
subset.setBlockSize(100)
subset.setMaximumOuterSampling(20)  # 2000 draws a level
subset.run()
found = subset.getResult()
print(
    f"OpenTURNS: P = {found.getProbabilityEstimate():.3g}, cv"
    f" {found.getCoefficientOfVariation():.2g}, {limit_state.dimension} dimensions"
)

own = st.failure_probability(problem, strength, stress, method=method, algorithm="subset")
print(own)
