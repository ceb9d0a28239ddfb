# One paper: a gain changed, the paper's figures drawn over those of the published run, rows as CSV.
adcs run zhang2018-ppatc --set 'controller.K=[0.25,0.05,0.25]' --out results/weak
adcs plot results/weak --published --format pdf,png --out results/figures
adcs run zhang2018-ppatc --set 'controller.K=[0.25,0.05,0.25]' --format csv --out results/weak_csv
adcs metrics results/weak results/weak_csv --format csv
