"""The winning cells of the paper's two cases, C1 and C2."""

import holdfast

for name in ("paper-bi", "paper-uni"):
    synthesis = holdfast.Spec(name).synth()
    for law in synthesis.laws:
        winning = synthesis.winning(law)
        print(name, law, winning.sum(), "of", winning.size)
