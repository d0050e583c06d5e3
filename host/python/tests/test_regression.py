"""The estimator with and within scikit-learn."""

import pickle

import numpy as np
import pamtools as pam
from test_notebook import everything, main


def rows(campaign):
    X = np.concatenate([np.column_stack([r.time, r.pressure, r.stroke]) for r in campaign])
    y = np.concatenate([r.force for r in campaign])
    groups = np.concatenate([np.full(len(r), i) for i, r in enumerate(campaign)])
    # Recordings of a campaign share a clock; each begins at zero here, as files of many benches do.
    for i in range(len(campaign)):
        X[groups == i, 0] -= X[groups == i, 0][0]
    return X, y, groups


def refuses(act, words, kind=ValueError):
    try:
        act()
    except kind as error:
        assert words in str(error), error
    else:
        raise AssertionError(f"it was taken: {words}")


def test_it_fits_predicts_and_scores_rows():
    muscle, campaign = everything()
    X, y, _ = rows(campaign)
    model = pam.MuscleRegressor(muscle)
    refuses(lambda: model.predict(X), "not fitted")
    assert model.fit(X, y) is model
    assert model.predict(X).shape == y.shape
    assert model.score(X, y) > 0.999
    assert model.n_features_in_ == 3 and abs(model.table_.deadband - 76.5e3) < 15e3
    # Fitted twice is fitted once, and a copy predicts the same.
    first = model.predict(X)
    np.testing.assert_array_equal(model.fit(X, y).predict(X), first)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(X), first)
    refuses(lambda: pam.MuscleRegressor().fit(X, y), "needs the muscle's description")
    refuses(lambda: model.fit(X[:, :2], y), "three columns")
    refuses(lambda: model.fit(X, y[1:]), "one force for each")
    refuses(lambda: model.fit(np.where(X == X[5, 1], np.nan, X), y), "NaN")
    mixed = np.random.default_rng(1).permutation(len(X))
    refuses(lambda: model.fit(X[mixed], y[mixed]), "time order")


def test_data_frames_have_their_units_in_their_names():
    import pandas

    muscle, campaign = everything()
    X, y, _ = rows(campaign)
    frame = pandas.DataFrame({"time_s": X[:, 0], "pressure_kPa": X[:, 1] / 1e3, "displacement_mm": X[:, 2] * 1e3})
    model = pam.MuscleRegressor(muscle).fit(frame, y)
    assert list(model.feature_names_in_) == list(frame.columns)
    np.testing.assert_allclose(model.predict(frame), pam.MuscleRegressor(muscle).fit(X, y).predict(X), rtol=1e-6)


def test_it_works_inside_scikit_learn():
    from sklearn.base import clone, is_regressor
    from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import FunctionTransformer

    muscle, campaign = everything()
    X, y, groups = rows(campaign)
    model = pam.MuscleRegressor(muscle, order=3)
    assert is_regressor(model)
    again = clone(model)
    assert again is not model and again.get_params() == model.get_params() and not hasattr(again, "table_")
    assert cross_val_score(model, X, y, groups=groups, cv=GroupKFold(3)).min() > 0.98
    search = GridSearchCV(model, {"order": [1, 4]}, cv=GroupKFold(3)).fit(X, y, groups=groups)
    assert search.best_params_ == {"order": 4}, search.cv_results_
    kilopascals = FunctionTransformer(lambda X: X * [1, 1e3, 1])
    scaled = X / [1, 1e3, 1]
    np.testing.assert_allclose(make_pipeline(kilopascals, pam.MuscleRegressor(muscle)).fit(scaled, y).score(scaled, y), pam.MuscleRegressor(muscle).fit(X, y).score(X, y))


# Checks of scikit-learn that feed random numbers, which are not recordings of a muscle, or need scikit-learn's own way of checking inputs.
def test_checks_of_scikit_learn_that_need_no_random_data_pass():
    import sklearn.utils.estimator_checks as checks

    muscle, _ = everything()
    passed = 0
    for name in [
        "check_estimator_cloneable",
        "check_estimator_tags_renamed",
        "check_valid_tag_types",
        "check_estimator_repr",
        "check_no_attributes_set_in_init",
        "check_get_params_invariance",
        "check_set_params",
        "check_do_not_raise_errors_in_init_or_set_param",
        "check_parameters_default_constructible",
        "check_mixin_order",
        "check_estimator_get_tags_default_keys",
    ]:
        check = getattr(checks, name, None)
        if check is not None:
            check("MuscleRegressor", pam.MuscleRegressor(muscle))
            passed += 1
    assert passed >= 8, passed


if __name__ == "__main__":
    main(globals())
