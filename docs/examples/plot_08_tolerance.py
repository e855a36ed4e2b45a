"""
Load sharing with manufacturing errors
======================================

Pin positions have tolerances of some hundredths of a millimetre. Random sets of parts give the
distribution of the load sharing.
"""

import flexgear as fg

case = fg.load_case("herringbone", {
    "tolerance.samples": 100,
    "tolerance.errors.pin_tangential.standard_deviation_um": 15,
})  # fmt: skip
study = fg.tolerance(case, workers=1)
print(study.load_sharing_max.quantile(0.95, "sample", method="median_unbiased").values)
figure = study.fg.plot.load_sharing()
figure.savefig("tolerance.png")
print("wrote tolerance.png")
