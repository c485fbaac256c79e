<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
  <context>
    <name>TreeDGS</name>
    <message>
      <source>Trees</source>
      <translation>Bäume</translation>
    </message>
    <message>
      <source>Camera stations</source>
      <translation>Kamerastandorte</translation>
    </message>
    <message>
      <source>Pairs</source>
      <translation>Paare</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Install the libraries that the TreeDGS algorithms need, in an environment of their own.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Makes a Python environment in your data folder (or in TREEDGS_HOME), about 3 GB, and installs the pinned list of
libraries with pip. QGIS and its Python are not touched. It needs Python 3.10 or newer with venv on this computer, and
the network or a folder of wheels. What was cut short is taken up by running it again.&lt;/p&gt;
&lt;p&gt;On a machine with &lt;code&gt;make&lt;/code&gt;, &lt;code&gt;make setup&lt;/code&gt; does the same for the repository.&lt;/p&gt;</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Set up the engine</source>
      <translation>Rechenkern einrichten</translation>
    </message>
    <message>
      <source>Setup</source>
      <translation>Einrichtung</translation>
    </message>
    <message>
      <source>Install the engine's libraries in an environment of their own.</source>
      <translation>Installiert die Bibliotheken des Rechenkerns in einer eigenen Umgebung.</translation>
    </message>
    <message>
      <source>Python to build with</source>
      <translation>Python für die Einrichtung</translation>
    </message>
    <message>
      <source>Folder of wheels (no network)</source>
      <translation>Ordner mit Wheels (ohne Netz)</translation>
    </message>
    <message>
      <source>PyTorch build</source>
      <translation>PyTorch-Variante</translation>
    </message>
    <message>
      <source>Start from scratch</source>
      <translation>Neu anfangen</translation>
    </message>
    <message>
      <source>The engine's Python</source>
      <translation>Python des Rechenkerns</translation>
    </message>
    <message>
      <source>Terrain model</source>
      <translation>Geländemodell</translation>
    </message>
    <message>
      <source>Parameters</source>
      <translation>Parameter</translation>
    </message>
    <message>
      <source>Advanced parameters</source>
      <translation>Erweiterte Parameter</translation>
    </message>
    <message>
      <source>On the command line:</source>
      <translation>Auf der Befehlszeile:</translation>
    </message>
    <message>
      <source>Done in {time}.</source>
      <translation>Fertig nach {time}.</translation>
    </message>
    <message>
      <source>Results</source>
      <translation>Ergebnisse</translation>
    </message>
    <message>
      <source>Camera positions</source>
      <translation>Kamerapositionen</translation>
    </message>
    <message>
      <source>Photos and their positions</source>
      <translation>Fotos und ihre Positionen</translation>
    </message>
    <message>
      <source>Cameras from the photos</source>
      <translation>Kameras aus den Fotos</translation>
    </message>
    <message>
      <source>Features in each photo</source>
      <translation>Merkmale in jedem Foto</translation>
    </message>
    <message>
      <source>Same points in several photos</source>
      <translation>Gleiche Punkte in mehreren Fotos</translation>
    </message>
    <message>
      <source>First placing of the cameras</source>
      <translation>Erste Lage der Kameras</translation>
    </message>
    <message>
      <source>Fine adjustment of the cameras</source>
      <translation>Feinausgleichung der Kameras</translation>
    </message>
    <message>
      <source>Dense points</source>
      <translation>Dichte Punkte</translation>
    </message>
    <message>
      <source>Ground under the trees</source>
      <translation>Boden unter den Bäumen</translation>
    </message>
    <message>
      <source>Stems and their diameters</source>
      <translation>Stämme und ihre Durchmesser</translation>
    </message>
    <message>
      <source>Looking for stems</source>
      <translation>Suche nach Stämmen</translation>
    </message>
    <message>
      <source>Fitting each stem</source>
      <translation>Anpassung jedes Stamms</translation>
    </message>
    <message>
      <source>Cutting out the stems in the photos</source>
      <translation>Ausschneiden der Stämme aus den Fotos</translation>
    </message>
    <message>
      <source>Measuring each stem</source>
      <translation>Messung jedes Stamms</translation>
    </message>
    <message>
      <source>Fitting Gaussians</source>
      <translation>Anpassung der Gauß-Elemente</translation>
    </message>
    <message>
      <source>Surface points</source>
      <translation>Oberflächenpunkte</translation>
    </message>
    <message>
      <source>Reading the point cloud</source>
      <translation>Lesen der Punktwolke</translation>
    </message>
    <message>
      <source>Plots and terrain model</source>
      <translation>Probeflächen und Geländemodell</translation>
    </message>
    <message>
      <source>Overlap of the photos</source>
      <translation>Überlappung der Fotos</translation>
    </message>
    <message>
      <source>Pairing field and measured trees</source>
      <translation>Paarung von Feld- und gemessenen Bäumen</translation>
    </message>
    <message>
      <source>Writing layer and report</source>
      <translation>Schreiben von Layer und Bericht</translation>
    </message>
    <message>
      <source>Reading the tables</source>
      <translation>Lesen der Tabellen</translation>
    </message>
    <message>
      <source>Estimating per hectare</source>
      <translation>Schätzung je Hektar</translation>
    </message>
    <message>
      <source>about {time} left</source>
      <translation>noch etwa {time}</translation>
    </message>
    <message>
      <source>Plots</source>
      <translation>Probeflächen</translation>
    </message>
    <message>
      <source>Suggested pairs</source>
      <translation>Vorgeschlagene Paare</translation>
    </message>
    <message>
      <source>Measured trees</source>
      <translation>Gemessene Bäume</translation>
    </message>
    <message>
      <source>Field trees</source>
      <translation>Feldbäume</translation>
    </message>
    <message>
      <source>Stem slices</source>
      <translation>Stammscheiben</translation>
    </message>
    <message>
      <source>Stem circles</source>
      <translation>Stammkreise</translation>
    </message>
    <message>
      <source>From drone photos to a stand table</source>
      <translation>Von Drohnenfotos zur Bestandestabelle</translation>
    </message>
    <message>
      <source>From a point cloud to a stand table</source>
      <translation>Von der Punktwolke zur Bestandestabelle</translation>
    </message>
    <message>
      <source>From drone photos to accuracy against field trees</source>
      <translation>Von Drohnenfotos zur Genauigkeit gegen Feldbäume</translation>
    </message>
    <message>
      <source>Ready-made models</source>
      <translation>Fertige Modelle</translation>
    </message>
    <message>
      <source>in {unit}</source>
      <translation>in {unit}</translation>
    </message>
    <message>
      <source>{low} to {high}</source>
      <translation>{low} bis {high}</translation>
    </message>
    <message>
      <source>at least {low}</source>
      <translation>mindestens {low}</translation>
    </message>
    <message>
      <source>at most {high}</source>
      <translation>höchstens {high}</translation>
    </message>
    <message>
      <source>Measure DBH from drone photos</source>
      <translation>BHD aus Drohnenfotos messen</translation>
    </message>
    <message>
      <source>Measure trees</source>
      <translation>Bäume messen</translation>
    </message>
    <message>
      <source>Drone photos (and PPK geotags) in, tree points with DBH, error and reasons out.</source>
      <translation>Drohnenfotos (und PPK-Geotags) hinein, Baumpunkte mit BHD, Fehler und Gründen heraus.</translation>
    </message>
    <message>
      <source>Inputs: overlapping drone photos taken above the canopy, most of them oblique (30 to 50 degrees from straight down), at about 2 cm a pixel or finer; PPK or RTK geotags. Output: one point per stem found, with DBH (cm), its standard error and 90 % interval (cm), and a reason wherever no DBH could be measured. Stems under 7.5 cm and stems that fewer than three photos see at breast height are refused. A second run in the same workspace resumes.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Photos</source>
      <translation>Fotos</translation>
    </message>
    <message>
      <source>Folder with the original drone photos (JPEG) of one plot or block.</source>
      <translation>Ordner mit den originalen Drohnenfotos (JPEG) einer Probefläche oder eines Blocks.</translation>
    </message>
    <message>
      <source>Geotags</source>
      <translation>Geotags</translation>
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos (PPK), or a CSV; without it EXIF/XMP positions are used.</source>
      <translation>Ordner oder Datei mit MRK und RTKLIB-.pos (PPK) oder eine CSV; sonst gelten die Positionen aus EXIF/XMP.</translation>
    </message>
    <message>
      <source>DTM</source>
      <translation>Geländemodell (DGM)</translation>
    </message>
    <message>
      <source>Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is found in the photos.</source>
      <translation>Geländemodell (GeoTIFF) in den Höhen der Geotags; ohne es wird der Boden in den Fotos gesucht.</translation>
    </message>
    <message>
      <source>CRS</source>
      <translation>KBS</translation>
    </message>
    <message>
      <source>Project CRS, projected and in metres, for example EPSG:6344.</source>
      <translation>KBS des Projekts, projiziert und in Metern, zum Beispiel EPSG:25832.</translation>
    </message>
    <message>
      <source>CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); without it all that photos see well.</source>
      <translation>CSV der Probeflächen: plot_id, easting, northing, radius_m (oder lon, lat); sonst alles, was die Fotos gut sehen.</translation>
    </message>
    <message>
      <source>Preset</source>
      <translation>Voreinstellung</translation>
    </message>
    <message>
      <source>How much is modelled: fast and best differ in photos and features used; paper = the published method.</source>
      <translation>Wie viel modelliert wird: fast und best unterscheiden sich in genutzten Fotos und Merkmalen; paper = das veröffentlichte Verfahren.</translation>
    </message>
    <message>
      <source>Fit</source>
      <translation>Anpassung</translation>
    </message>
    <message>
      <source>photos = stems fitted straight to the photos; gaussians = stem primitives among Gaussians; paper = splats with the published constants; auto = what the data supports.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Breast height [m]</source>
      <translation>Brusthöhe [m]</translation>
    </message>
    <message>
      <source>Breast height above ground.</source>
      <translation>Brusthöhe über dem Boden.</translation>
    </message>
    <message>
      <source>Seed</source>
      <translation>Startwert</translation>
    </message>
    <message>
      <source>Seed of every random choice.</source>
      <translation>Startwert aller Zufallszüge.</translation>
    </message>
    <message>
      <source>Dry run</source>
      <translation>Probelauf</translation>
    </message>
    <message>
      <source>Only check inputs, overlap, fixed positions, memory and disk, and foretell the time; writes nothing.</source>
      <translation>Nur Eingaben, Überlappung, fixierte Positionen, Speicher und Platte prüfen und die Zeit vorhersagen; schreibt nichts.</translation>
    </message>
    <message>
      <source>Workspace</source>
      <translation>Arbeitsordner</translation>
    </message>
    <message>
      <source>Folder for intermediate results; a second run resumes there.</source>
      <translation>Ordner für Zwischenergebnisse; ein zweiter Lauf setzt dort fort.</translation>
    </message>
    <message>
      <source>Output</source>
      <translation>Ausgabe</translation>
    </message>
    <message>
      <source>Tree layer to write (.gpkg, .shp, .geojson or .csv).</source>
      <translation>Zu schreibender Baumlayer (.gpkg, .shp, .geojson oder .csv).</translation>
    </message>
    <message>
      <source>tree layer (file)</source>
      <translation>Baumlayer (Datei)</translation>
    </message>
    <message>
      <source>HTML report (file)</source>
      <translation>HTML-Bericht (Datei)</translation>
    </message>
    <message>
      <source>run.json: parameters, versions, seconds, peak memory (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems found</source>
      <translation>gefundene Stämme</translation>
    </message>
    <message>
      <source>stems with a DBH</source>
      <translation>Stämme mit BHD</translation>
    </message>
    <message>
      <source>stems without one, each with a reason</source>
      <translation>Stämme ohne BHD, jeder mit einem Grund</translation>
    </message>
    <message>
      <source>mean DBH of the measured stems, cm</source>
      <translation>mittlerer BHD der gemessenen Stämme, cm</translation>
    </message>
    <message>
      <source>photos that can be used (dry run)</source>
      <translation>brauchbare Fotos (Probelauf)</translation>
    </message>
    <message>
      <source>photos with a fixed position, % (dry run)</source>
      <translation>Fotos mit fixierter Position, % (Probelauf)</translation>
    </message>
    <message>
      <source>ground that neighbouring photos share, % (dry run)</source>
      <translation>gemeinsamer Boden benachbarter Fotos, % (Probelauf)</translation>
    </message>
    <message>
      <source>foretold time, s (dry run)</source>
      <translation>vorhergesagte Zeit, s (Probelauf)</translation>
    </message>
    <message>
      <source>foretold memory, GB (dry run)</source>
      <translation>vorhergesagter Speicher, GB (Probelauf)</translation>
    </message>
    <message>
      <source>foretold disk, GB (dry run)</source>
      <translation>vorhergesagter Plattenplatz, GB (Probelauf)</translation>
    </message>
    <message>
      <source>what came out, in one sentence</source>
      <translation>was herauskam, in einem Satz</translation>
    </message>
    <message>
      <source>Measure DBH from a point cloud</source>
      <translation>BHD aus einer Punktwolke messen</translation>
    </message>
    <message>
      <source>From a LiDAR cloud (drone or terrestrial) or surface points to tree points with DBH.</source>
      <translation>Von einer LiDAR-Wolke (Drohne oder terrestrisch) oder Oberflächenpunkten zu Baumpunkten mit BHD.</translation>
    </message>
    <message>
      <source>Finds the ground (or takes your DTM), finds the stems in the band from 0.5 to 5 m, measures each at breast height and writes the tree layer: DBH, standard error and 90 % interval in cm, lean, height where the cloud reaches the crowns, and for every stem that cannot be measured the reason. Needs about 100 points on the lower 3 m of a stem (drone LiDAR above 1,000 points/m2, or a terrestrial scan). The CRS comes from the file; give --crs where it has none ('local' for a scan without a place on the map).</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Input</source>
      <translation>Eingabe</translation>
    </message>
    <message>
      <source>point cloud: LAS, LAZ, COPC, or text with x y z per line</source>
      <translation>Punktwolke: LAS, LAZ, COPC oder Text mit x y z je Zeile</translation>
    </message>
    <message>
      <source>terrain raster; without it the ground is found in the cloud</source>
      <translation>Geländeraster; ohne es wird der Boden in der Wolke gesucht</translation>
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local' for metres without a place on the map</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Weights</source>
      <translation>Gewichte</translation>
    </message>
    <message>
      <source>reliability of the points: none, LiDAR intensity (as it is, or brought to one range), or opacity of surface points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>cross-section model</source>
      <translation>Modell des Querschnitts</translation>
    </message>
    <message>
      <source>Method</source>
      <translation>Verfahren</translation>
    </message>
    <message>
      <source>default = our estimator; paper = the published constants</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>breast height</source>
      <translation>Brusthöhe</translation>
    </message>
    <message>
      <source>Min DBH [cm]</source>
      <translation>Kleinster BHD [cm]</translation>
    </message>
    <message>
      <source>thinner stems are refused as too small</source>
      <translation>dünnere Stämme werden als zu klein verworfen</translation>
    </message>
    <message>
      <source>Max DBH [cm]</source>
      <translation>Größter BHD [cm]</translation>
    </message>
    <message>
      <source>thicker stems are refused as too large</source>
      <translation>dickere Stämme werden als zu groß verworfen</translation>
    </message>
    <message>
      <source>Max lean [deg]</source>
      <translation>Größte Neigung [Grad]</translation>
    </message>
    <message>
      <source>more lean is refused</source>
      <translation>stärkere Neigung wird verworfen</translation>
    </message>
    <message>
      <source>Source</source>
      <translation>Quelle</translation>
    </message>
    <message>
      <source>what made the points</source>
      <translation>woher die Punkte stammen</translation>
    </message>
    <message>
      <source>seed of the random draws</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>tree layer</source>
      <translation>Baumlayer</translation>
    </message>
    <message>
      <source>Only check the cloud, its CRS, density and DTM, memory and disk, and foretell the time; writes nothing</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stems output</source>
      <translation>Ausgabe der Stämme</translation>
    </message>
    <message>
      <source>also write the stem points with tree_id</source>
      <translation>auch die Stammpunkte mit tree_id schreiben</translation>
    </message>
    <message>
      <source>stem points</source>
      <translation>Stammpunkte</translation>
    </message>
    <message>
      <source>stems in the layer</source>
      <translation>Stämme im Layer</translation>
    </message>
    <message>
      <source>without remark</source>
      <translation>ohne Anmerkung</translation>
    </message>
    <message>
      <source>to check</source>
      <translation>zu prüfen</translation>
    </message>
    <message>
      <source>refused</source>
      <translation>verworfen</translation>
    </message>
    <message>
      <source>mean DBH, cm</source>
      <translation>mittlerer BHD, cm</translation>
    </message>
    <message>
      <source>points (dry run)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>points a square metre (dry run)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>verdict (dry run)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Measure many plots</source>
      <translation>Viele Probeflächen messen</translation>
    </message>
    <message>
      <source>Many plots from one table, on this machine or a cluster: one trees layer, one report.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>One row of the table is one plot, from photos or from a point cloud. All rows are checked before anything starts. Plots run side by side, as many as memory and cores carry, each in a folder of its own; a plot that fails is tried again at most twice and then reported, the others go on. A second start runs only what is missing or whose inputs or settings have changed. Writes one trees layer with plot ids, campaign.html and plots.csv (trees, refusals and reasons, seconds, memory, accuracy where field trees are given). With --predict it only says how long it will take.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Manifest</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CSV with one row a plot: plot_id, photos (folder) or cloud (file), and where wanted geotags, dtm, crs, plots, field and any setting of the verb by its name; paths count from the table's folder</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CRS of rows that give none, and of the layer when rows have different ones</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Scheduler</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>where plots run: local, tcp://host:8786 (a running Dask scheduler), slurm or pbs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Workers</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots at once; 0 = as many as cores and memory carry</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Predict</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>only check the table and say how long it will take and what it needs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Threads</source>
      <translation>Threads</translation>
    </message>
    <message>
      <source>processor threads a plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Memory [GB]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>memory for all plots together (in a queue: of each job); 0 = what is free, less a reserve</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Time limit [min]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>end a plot that takes longer; 0 = never</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Patience [s]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>how long to wait for a scheduler or workers that are lost</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Dashboard</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Dask's live view: auto (a free port), off, or an address like :8787</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Queue options</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>for slurm and pbs: queue=…,walltime=08:00:00,account=…,jobs=20,memory=16GB,cores=4</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Costs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>cost model (costs.json of another campaign) for the forecast and the memory that plots declare</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder for the campaign; a second start does what is missing</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>the one trees layer (.gpkg or .csv); without it trees.gpkg in the workspace</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees layer of all plots (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>campaign report (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>one row a plot (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots in the table</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots measured, now or before</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots run by this start</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots kept from an earlier start</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots given up, each with its reason in the report</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seconds of this start</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seconds that were forecast</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Geotag drone photos</source>
      <translation>Drohnenfotos verorten</translation>
    </message>
    <message>
      <source>Single steps</source>
      <translation>Einzelne Schritte</translation>
    </message>
    <message>
      <source>MRK and RTKLIB .pos (or EXIF/XMP) to camera positions at the exposure, as a point layer.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Inputs: the photos, and a folder with the drone's Timestamp.MRK and the PPK solution (.pos), or a CSV by photo name. RINEX of rover and base is solved by RTKLIB (rnx2rtkp). The antenna's path is interpolated at each exposure and the lever arm applied once; heights stay ellipsoidal unless the project CRS has a height datum, which needs its geoid grid. Output: layer 'stations' (PointZ, project CRS) with quality (fix, float, single, exif, none), standard deviations (m), time, flight and gimbal angles (degrees). Photos that are blurred or show nothing are left out with a warning; geotags of other photos are refused.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Folder with the original drone photos (searched with its subfolders).</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos or RINEX (PPK), or a CSV with name, lat, lon, h; without it EXIF/XMP positions are used.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Project CRS, projected and in metres, for example EPSG:6344, or with a height datum, EPSG:6344+5703.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Camera stations layer to write.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Geotags CRS</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Reference frame of the geotags (geographic), for example EPSG:7912 for ITRF2014; default: the project's.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Base</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>RINEX observations of the base station, when they do not lie with the geotags.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Base position</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Base station 'latitude, longitude, height' (degrees, ellipsoidal m), for RINEX; default: its header's.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Tagged photos</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>New folder for copies of the photos with the corrected EXIF/XMP position; originals are never changed.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Camera delay ms [ms]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Exposure minus mark time, for cameras triggered by cable.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Check photos</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Leave out blurred and empty photos.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>camera stations layer (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos with a fixed PPK/RTK position</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos with a float position</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos with a navigation-grade position</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos without a position</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>flights</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>tagged copies written</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Reconstruct cameras from photos</source>
      <translation>Kameras aus Fotos rekonstruieren</translation>
    </message>
    <message>
      <source>Georeferenced structure from motion: camera poses, sparse points, dense points of the stem band.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Inputs: overlapping drone photos (80 % overlap, most of them oblique) and their PPK, RTK or EXIF positions. All flights end in one frame, adjusted with the geotags as priors. Output in the workspace: geotags.gpkg, sfm/ (COLMAP model in a local frame, frame.json with the CRS and origin, report.json) and dense.laz (stem band of the plots, project CRS). A block that contradicts its geotags, the lens calibration in the metadata, or the flying height is refused.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos (PPK), or a CSV with name, lat, lon, h; without it EXIF/XMP positions are used.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is taken from the photos.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CSV of plots (plot_id, easting, northing, radius_m or lon, lat): where the stem band is made dense; without it no dense points are made.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Dense</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Make dense points of the stem band where plots are given.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Folder for the results; a second run resumes there.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Max features</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Most features per photo.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Processor threads, 0 = all.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder of the results</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>COLMAP model (folder)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>dense points of the stem band (file)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos registered</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>RMS reprojection error, px</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>RMS distance of cameras to their geotags, E, N, U, m</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>focal length, px</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>sparse points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>dense points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seconds of structure from motion</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Terrain model from a point cloud</source>
      <translation>Geländemodell aus einer Punktwolke</translation>
    </message>
    <message>
      <source>Find the ground in a point cloud and write a terrain model (DTM).</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>A cloth is draped over the lowest points (cloth simulation filter), low plants are removed by a robust surface, and the ground is gridded by local planes. The GeoTIFF holds the ground height (band 1, metres, in the cloud's vertical datum) and the distance to the nearest ground point (band 2): read band 2 before you trust band 1. Cells farther than 10 m from ground are nodata.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Cloth [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>cell size of the cloth</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Rigidness</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>1 steep, 2 hilly, 3 flat terrain</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Threshold [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>largest distance of ground points from the cloth</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Rounds</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>most iterations of the cloth</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Thin [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>one lowest point a cell of this size hangs the cloth</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Ground [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>points this close to the final surface are ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>terrain raster to write</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local'</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Resolution [m]</source>
      <translation>Auflösung [m]</translation>
    </message>
    <message>
      <source>cell size</source>
      <translation>Zellgröße</translation>
    </message>
    <message>
      <source>Ground points</source>
      <translation>Bodenpunkte</translation>
    </message>
    <message>
      <source>also write the cloud, ground points as class 2 and heights above ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Use classes</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trust the file's class 2 instead of finding the ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>terrain raster</source>
      <translation>Geländeraster</translation>
    </message>
    <message>
      <source>points read</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>ground points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of the extent with a ground height, %</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>distance to the nearest ground point that 95 % of the cells stay under, m</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>classified cloud</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Fit Gaussians to the stem band</source>
      <translation>Gauß-Elemente an das Stammband anpassen</translation>
    </message>
    <message>
      <source>3D Gaussians around each stem, from the ground to a few metres, fitted to the photos.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Needs a workspace with a reconstruction (sfm/) and a terrain model (dtm.tif), and stem positions good to a few decimetres. For each stem a tapered, leaning primitive and the Gaussians around it are fitted together to crops of the photos (the losses of the RaDe-GS paper, re-derived), with the ground behind as a texture. Output: stem_primitives.csv with the diameters, and field.ply, the standard 3DGS format in local metres (its origin and CRS are in field.frame.json beside it). With stems = free, Gaussians only, as published.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>how much work is spent</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Gaussians</source>
      <translation>Gauß-Elemente</translation>
    </message>
    <message>
      <source>Gaussians per stem</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Max gaussians</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>hard limit on Gaussians in all; shared among the stems</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Coarse epochs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>passes over the crops at half resolution</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Fine epochs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>passes over the crops at full resolution</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Max views</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos used per stem</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>SSIM</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of D-SSIM in the photometric loss</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Normals</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>weight of depth-normal consistency</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Fog</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>price of covering a pixel, in mean absolute colour (0..1); keeps Gaussians from explaining the ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Band [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>top of the modelled stem band above ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Radius [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>radius of the modelled cylinder about each seed</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Mask foliage</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>leave out green pixels where the photos' colours show a clear split</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stems</source>
      <translation>Stämme</translation>
    </message>
    <message>
      <source>primitive = a tapered stem is fitted in one loop with the Gaussians around it, and its bark written as Gaussians; start = its bark Gaussians are then fitted freely; free = nothing but Gaussians, as published</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stem gaussians</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Gaussians around a stem primitive (twigs and leaves before and beside it)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stem epochs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>passes over the crops in which primitive and Gaussians are fitted together</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>breast height above the ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Density</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>of free Gaussians: relocate = a fixed number, dead ones move onto live ones; split = split, clone and prune up to the limit</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Controller</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>of free Gaussians: fixed = every epoch of the preset; plateau = stop when two held-out photos no longer improve; backtrack = go back to the last good state with smaller steps instead; rlgs = a learned policy chooses the steps (several times slower)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Device</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>where Gaussians are drawn: cpu, or cuda = an NVIDIA GPU through the optional package warp-lang</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems fitted at once</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>random seed</source>
      <translation>Startwert</translation>
    </message>
    <message>
      <source>Workspace with sfm/ and dtm.tif; field.ply is written there.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Folder of the reconstructed photos; without it the one in run.json.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Seeds</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stem positions, good to a few decimetres: a point layer, or a CSV with x, y in the project CRS; without it trees.gpkg of the workspace.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Dense points that free Gaussians start from: LAS/LAZ, or OpenMVS's scene_dense.ply in the local frame of sfm/; without it dense.laz of the workspace, if there.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Gaussian field (3DGS PLY, local metres)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>number of Gaussians</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems fitted</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Sample surface points from Gaussians</source>
      <translation>Oberflächenpunkte aus Gauß-Elementen ziehen</translation>
    </message>
    <message>
      <source>Points drawn inside the Gaussians, each with its opacity reliability over the photos.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Needs a workspace with field.ply (fit-gaussians). Draws up to M points inside each Gaussian, thinned by its opacity, and scores each by the opacity in front of it in every photo: the smallest over the photos that show Gaussians there is kept. Output: surface.laz in the project CRS with the extra dimensions opacity (0..1), n_views (photos that show Gaussians there), n_seen (photos that see the point) and seed_id (which stem position the Gaussian was fitted for).</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Samples</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>candidate points drawn per Gaussian (M)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Law</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>opacity law: clamp = RaDe-GS depth clamp, vacancy = stochastic solid</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Tau</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>keep points whose smallest opacity over the views is above this</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Seen transmittance</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>a view sees a point when more than this share of light gets past what is in front of it; Gaussians that no view sees are dropped (0 keeps all)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Quantile</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>opacity kept of a point: this quantile over its foreground views; 0 = the smallest, as published</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min foreground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>a view counts as foreground where the accumulated alpha is above this</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>views scored at once</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Workspace with sfm/ and field.ply; surface.laz is written there.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>paper = every point of the published method, those that no view sees included.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>sampled = drawn inside the Gaussians and scored; for comparison: means = their centres alone, depth = fused depth maps.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>surface points (LAZ with opacity, n_views)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>number of points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Find stems in a point cloud</source>
      <translation>Stämme in einer Punktwolke finden</translation>
    </message>
    <message>
      <source>Find stems in a point cloud and give each point the id of its tree.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem), height_m and stem_class (0 other, 1 ground, 2 stem). --segmenter runs a program that you installed instead and checks that its labels belong to the points it was given.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Low [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>bottom of the band that is searched</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>High [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>top of the band that is searched</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>thickest stem</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>most lean</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min rows</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of 25 cm rows of the band that must show bark</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min arc [deg]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>least circumference seen, all rows together</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Grow [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>height up to which stem points are followed</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stem points with tree_id</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Keep all</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>write every point (tree_id 0 = no stem), not only stem points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Segmenter</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>who finds the trees: own needs nothing; the others are programs that you installed yourself (docs/measuring.md)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Segmenter command</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>command line of that program, with {input} and {output} for its folders</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stem points with tree_id and height_m</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>points on stems</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>settings used: uls, tls, splat, or the segmenter</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Measure DBH of segmented stems</source>
      <translation>BHD segmentierter Stämme messen</translation>
    </message>
    <message>
      <source>Measure the DBH of stems whose points carry tree ids.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Takes a cloud with a tree-id dimension (segment-stems, or another segmenter with --id-field) and writes one point a tree: DBH with its standard error and 90 % interval in cm, at breast height above the ground at the stem. --method paper gives the published estimator (solid circles, taper RANSAC; with --fit cylinder the published cylinder); the default fits a leaning, tapering stem to the bark points. A stem that cannot be measured stays in the layer with qc_flag=reject and the reason.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>ID field</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>dimension of the cloud that holds the tree ids</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Pair field and measured trees</source>
      <translation>Feld- und gemessene Bäume paaren</translation>
    </message>
    <message>
      <source>Inventory</source>
      <translation>Inventur</translation>
    </message>
    <message>
      <source>Pair field trees with measured trees by position, as an editable layer.</source>
      <translation>Paart Feldbäume mit gemessenen Bäumen nach der Lage, als bearbeitbarer Layer.</translation>
    </message>
    <message>
      <source>Turns bearing and distance into coordinates (true, grid or magnetic north; level or slope distance; to the pith or the face), moves and turns each plot as a whole onto the measured trees, and pairs one to one. DBH is never used to pair, so the pairs can judge it. Where two placings fit about equally well, as in planted rows, the plot is left to you: the layer 'suggested' shows the best guess; set the plot's status to ok, or draw two pairs in the layer 'pairs', and run again. In the layer 'pairs', set pair_status to ok, moved (after dragging a line's end to another tree) or rejected: what you locked is kept when you run again onto the same file. Unpaired trees of both sides stay in the layers 'field_trees' and 'measured_trees'. Units: metres, centimetres, degrees.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>North</source>
      <translation>Nordrichtung</translation>
    </message>
    <message>
      <source>north that the bearings refer to (magnetic needs the date of the field work, or the declination)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Declination [degrees, east positive]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>magnetic declination at the plot on the day of the field work; default: from the World Magnetic Model by --field-date or the table's date column</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Field date</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>day of the field work, year-month-day, for the declination</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Distance</source>
      <translation>Entfernung</translation>
    </message>
    <message>
      <source>distance along the level or along the ground (then the table needs slope_deg or slope_pct)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>To</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>distance to the middle of the stem, or to its near face (half the DBH is added)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>DBH unit</source>
      <translation>Einheit des BHD</translation>
    </message>
    <message>
      <source>unit of a DBH column that does not say it (auto: from a name like dbh_cm)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Distance unit</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>unit of a distance column that does not say it (auto: from a name like distance_m)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Centre error [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>standard error of the plot centres (0.05 for RTK, 4 under dense canopy); the search reaches three times as far</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Rotation [degrees]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>the plot may be turned by up to this angle (compass, declination)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Gate [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees further apart than this after co-registration are never a pair</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min ratio</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>best placing must score this many times the next best, else the plot is left to you</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min share</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of the trees that must find a partner within 1 m, else the plot is left to you</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min margin</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>a pair must be exp(this) times as likely as the best pairing without it, else it is only suggested</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>measured trees: a tree layer, or CSV with tree_id, x, y, dbh_cm</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Field</source>
      <translation>Feldaufnahme</translation>
    </message>
    <message>
      <source>field tally: plot_id, tree_id, azimuth_deg, distance_m (or easting, northing), dbh_cm</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plot centres: plot_id, easting, northing, epsg (or lon, lat), radius_m</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Trees DBH unit</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>unit of a DBH column in a CSV of measured trees that does not say it (auto: from a name like dbh_cm)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CRS of measured trees in a CSV, or of a layer without one</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>pairs layer; pairs locked in an existing file are kept</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>pairs layer</source>
      <translation>Paar-Layer</translation>
    </message>
    <message>
      <source>field trees</source>
      <translation>Feldbäume</translation>
    </message>
    <message>
      <source>pairs made or confirmed</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>suggestions left to a hand check</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plots</source>
      <translation>Probeflächen</translation>
    </message>
    <message>
      <source>plots left to a hand check</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Evaluate DBH accuracy</source>
      <translation>Genauigkeit des BHD bewerten</translation>
    </message>
    <message>
      <source>Accuracy tables and charts of measured DBH against field DBH.</source>
      <translation>Tabellen und Diagramme: gemessener BHD gegen Feld-BHD.</translation>
    </message>
    <message>
      <source>From the pairs layer of match-plots (pair_status auto, ok and moved count; rejected never): number of trees, success rate (trees with a DBH of all field trees), RMSE, RRMSE (of the mean field DBH), MAE, mean error (measured minus field), share of trees inside the stated 90 % interval and false trees, per plot and pooled, with bootstrap intervals by plot. Writes metrics.json, per_plot.csv, trees.csv, table.tex, charts (SVG and PNG) and evaluation.html. Plots left to a hand check do not count and are named. With --lidar and --splats: cylinder, circle and weighted circle on both, p chosen on held-out stems, densities, trend over DBH, ablation, and (simulated plots) segmentation scores and true labels. With --workspace-in: how many photos show breast height, and runtime. Units: centimetres and per cent; rates in metrics.json are 0 to 1.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>pairs layer of match-plots, checked by you</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>instead of pairs: a tree layer of a simulated plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Truth</source>
      <translation>Wahrheit</translation>
    </message>
    <message>
      <source>with --trees: the plot's truth/trees.csv</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Min clear views</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>with --truth: only stems with at least this many clear views count</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Against</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>pairs layer of another method for the same field trees: both are also scored on the trees both measured</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>smallest DBH that the field crew tallied; thinner measured trees are not counted as false</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>LiDAR</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>LiDAR cloud of the plot: adds the published cylinder and circles (with tree_id: as segmented)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Splats</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems.laz of a photos-to-dbh workspace with splats: the same fits on surface points</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>terrain for both clouds; without it each finds its own</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Workspace in</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>workspace of photos-to-dbh: adds visibility of breast height and runtime by stage</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Holdout [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems held out to choose the exponent p, the same for every method</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder for metrics.json, tables, charts and evaluation.html</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Repeats</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>bootstrap resamples</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seed of the bootstrap and of the held-out stems</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder</source>
      <translation>Ordner</translation>
    </message>
    <message>
      <source>the page to open</source>
      <translation>die zu öffnende Seite</translation>
    </message>
    <message>
      <source>metrics.json</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees measured and compared</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>measured of field trees, 0 to 1</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>RMSE, cm</source>
      <translation>RMSE, cm</translation>
    </message>
    <message>
      <source>RMSE, per cent of the mean field DBH</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>mean absolute error, cm</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>mean error, cm</source>
      <translation>mittlerer Fehler, cm</translation>
    </message>
    <message>
      <source>measured trees that are no field tree</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share inside the stated 90 % interval, 0 to 1</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stand table and report</source>
      <translation>Bestandestabelle und Bericht</translation>
    </message>
    <message>
      <source>Stand and stock tables per hectare with their errors, and a report for the client.</source>
      <translation>Bestandes- und Vorratstabellen je Hektar mit ihren Fehlern und ein Bericht für den Auftraggeber.</translation>
    </message>
    <message>
      <source>Expands the trees of fixed-area plots (round, rectangular or any polygon) to the hectare: trees, basal area, quadratic mean diameter, Lorey's and dominant height, volume and biomass by species and DBH class, plot means with standard errors and t intervals. Basal area and volume are freed of what the DBHs' own errors add to them, and the amount is shown. Stems without a DBH are counted and either imputed or left out; the result of both is told. Plots over the stand's edge are flagged and weighted. Volume and biomass come from a table of equations with source and range (loblolly and other pines first); give your own with --equations. From one plot no error for the stand can be given, and none is. Writes report.html, report.pdf, stand_table.xlsx, CSV files, stand.gpkg, shapefiles and FVS_Data.db (US units, for the Forest Vegetation Simulator), all with the same numbers. Result figures are metric.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>measured trees: the tree layer</source>
      <translation>gemessene Bäume: der Baumlayer</translation>
    </message>
    <message>
      <source>plots: centre and radius_m (or width_m, length_m), or a polygon layer; without: the whole boundary is one census</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Boundary</source>
      <translation>Bestandesgrenze</translation>
    </message>
    <message>
      <source>the stand's outline: finds plots that reach over its edge</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>pairs layer of match-plots: species and status of the measured trees</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>field tally: heights of the paired trees; without --trees it is the tree list itself</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Units</source>
      <translation>Einheiten</translation>
    </message>
    <message>
      <source>units of the report</source>
      <translation>Einheiten des Berichts</translation>
    </message>
    <message>
      <source>Class width [cm, or inches in US units]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>width of a DBH class (5 cm or 2 inches where not given)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>smallest DBH that counts</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Species</source>
      <translation>Baumart</translation>
    </message>
    <message>
      <source>species of trees that have none: PLANTS symbol, FIA number or name (PITA, 131, Pinus taeda)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Origin</source>
      <translation>Entstehung</translation>
    </message>
    <message>
      <source>how the stand came about</source>
      <translation>wie der Bestand entstanden ist</translation>
    </message>
    <message>
      <source>Missing</source>
      <translation>Fehlende</translation>
    </message>
    <message>
      <source>stems seen but without a DBH: count each as the mean of its plot's measured trees, or leave them out (both results are told)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Heights</source>
      <translation>Höhen</translation>
    </message>
    <message>
      <source>heights of trees that have none: from a curve fitted to the measured ones, none at all, or from a published regional curve</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Height unit</source>
      <translation>Einheit der Höhe</translation>
    </message>
    <message>
      <source>unit of a height column that does not say it (auto: from a name like height_m)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Equations</source>
      <translation>Gleichungen</translation>
    </message>
    <message>
      <source>your own equations, tried before the built-in ones</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Volume equation</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>id of the volume equation for all trees (docs/stand-table.md)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Biomass equation</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>id of the biomass equation for all trees</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Outside</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees outside an equation's range: use it and say so, or give no volume</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Edge</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees and plots at the stand's edge: zone (a tree weighs by the part of the plot-sized zone around it that is inside), walkthrough (some trees count twice), area (only the plot's part inside) or none (only flagged)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Plot size</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plot sizes are horizontal, or were laid out along the slope (then slope_pct or slope_deg is needed)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>DBH standard error [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>standard error of DBH for trees that have none</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Common standard error [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>standard error of a bias that all DBHs share (not given: 0.2 for measured trees, 0 for a field tally)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Confidence [%]</source>
      <translation>Vertrauen [%]</translation>
    </message>
    <message>
      <source>confidence of the intervals</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>breast height of the height curve, for a field tally (a tree layer says its own)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stand ID</source>
      <translation>Bestandeskennung</translation>
    </message>
    <message>
      <source>name of the stand, in every file</source>
      <translation>Name des Bestands, in jeder Datei</translation>
    </message>
    <message>
      <source>FVS variant</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>FVS variant, two letters (SN)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Year</source>
      <translation>Jahr</translation>
    </message>
    <message>
      <source>year of the inventory, for FVS</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>CRS of trees in a CSV, or of a layer without one</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder for the report and the tables</source>
      <translation>Ordner für Bericht und Tabellen</translation>
    </message>
    <message>
      <source>the same as PDF</source>
      <translation>dasselbe als PDF</translation>
    </message>
    <message>
      <source>plots and trees as map layers</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees measured in the plots</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems seen without a DBH</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees per hectare</source>
      <translation>Bäume je Hektar</translation>
    </message>
    <message>
      <source>basal area, m²/ha</source>
      <translation>Grundfläche, m²/ha</translation>
    </message>
    <message>
      <source>its standard error, m²/ha</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>quadratic mean diameter, cm</source>
      <translation>Durchmesser des Grundflächenmittelstamms, cm</translation>
    </message>
    <message>
      <source>Lorey's mean height, m</source>
      <translation>Lorey'sche Mittelhöhe, m</translation>
    </message>
    <message>
      <source>dominant height, m</source>
      <translation>Oberhöhe, m</translation>
    </message>
    <message>
      <source>volume, m³/ha</source>
      <translation>Volumen, m³/ha</translation>
    </message>
    <message>
      <source>above-ground biomass, t/ha</source>
      <translation>oberirdische Biomasse, t/ha</translation>
    </message>
    <message>
      <source>Benchmark speed and accuracy</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Tools</source>
      <translation>Werkzeuge</translation>
    </message>
    <message>
      <source>Chart seconds against DBH error for every preset and method; or test where they fail.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Runs each configuration (presets, number of photos, photo size, features, splats, LiDAR methods) on simulated plots with known truth and charts seconds, memory, RMSE and success rate, with the Pareto front and a recommended configuration for each preset. With --stability: one trouble at a time (few photos, wind, lean, pose noise, clutter, ...) at rising severity: errors, refusals, interval coverage, and every accepted tree that is more than 5 cm off. With --cost: how seconds and memory grow. Writes SVG, PNG, CSV, JSON, Markdown and a page without outside files. Compare seconds only within one run on an idle machine.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>simulated plot, or a folder of them, to measure on; without it plots are simulated</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder for charts and tables; finished runs are kept there, so that a stopped benchmark resumes</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Quick</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>one small plot and a dozen configurations: about 10 minutes on two idle cores</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stability</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>instead of the chart: the stability suite, one factor at a time from harmless to hopeless</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Cost</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>instead of the chart: seconds and memory of each stage against photos, megapixels, stems and points, fitted</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>runs of each configuration</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seeds of the stability suite</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Factors</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>only these factors of the stability suite, by commas</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Only</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>only these configurations of the chart, by commas</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Budget [min]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>begin nothing new after this long; 0 = no limit, with --quick 9.5 minutes</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Fresh</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stability: measure again what other measuring code had measured</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>the chart (SVG)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>runs of the chart</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>configuration for each preset</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>what there was no time for</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>cases of the stability suite</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>cases that it has</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>trees accepted by the photo method</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>of them more than 5 cm off</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>of them inside the stated 90 % interval, 0 to 1</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>at most 2 % of the accepted trees are more than 5 cm off</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>the paper's own case on this machine, minutes</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>seconds it took</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Simulate a plot</source>
      <translation>Eine Probefläche simulieren</translation>
    </message>
    <message>
      <source>Make a synthetic forest plot: drone photos, PPK files, LiDAR, field table and truth.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Grows a pine stand on rough ground and photographs it by ray casting in two oblique flights, with occluding crowns, shrubs and cast shadows, lens distortion and sensor noise. Writes images/ (EXIF, GPS, DJI XMP), the MRK and .pos files, dtm.tif, plots.csv, field_trees.csv, lidar/ and truth/ (for scoring only). Coordinates are EPSG:6344, heights ellipsoidal metres, DBH centimetres. Use it to try the chain, to test, or to see what a flight plan would measure. Real photos are harder: no wind, no rolling shutter, no motion blur.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Wind sway [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>sway of the crowns (18 m up) between photos, standard deviation</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Sweep [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>sideways bow of every in-plot stem over its lowest 4 m</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Butt flare [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>height over which the butt flare falls to a third; 0 = 0.16 to 0.28 m, drawn</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Ellipticity [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>widest less narrowest width of every stem, of the mean; 0 = up to 6, drawn</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Twins</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot trees with a second full stem beside them</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Twin gap [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>gap between the bark of twins at breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Clearing [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>no tree stands within this distance of the plot's centre</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Shaken [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of the photos with motion blur</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Shake [px]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>length of that motion blur</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Misexposed [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>share of the photos exposed wrongly, half of them too dark, half too light</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Misexposed stops [stops]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>by how much</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Exposure drift stops [stops]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>exposure of each photo, standard deviation</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>White drift [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>white balance of each photo, standard deviation a channel</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>PPK bias [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>constant shift of the whole PPK track in E, N and h (wrong base coordinates)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>folder for the plot; made if missing, replaced if it is a simulated plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>size of the job: micro (3-5 stems, for the stability suite), test (3-6 stems), demo (6-9 stems), plot (0.03 ha, 62 photos)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>random seed; the same seed gives the same plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Name</source>
      <translation>Name</translation>
    </message>
    <message>
      <source>plot name, used in file names; default: the folder's name</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>radius of the plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Stems [1/ha]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>planting density</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>DBH mean [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>mean diameter at breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>DBH standard deviation [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>its standard deviation</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Lean max [deg]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>largest lean of any stem</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Strong leans</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot stems that lean by 75-100 % of the largest lean</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Forks below breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot trees forked below breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Forks above breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot trees forked above breast height</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Touching saplings</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot stems touched by a sapling</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Dead trees</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in-plot trees without needles</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Leaf area [m2]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>one-sided needle area of a tree of mean DBH; what hides the stems</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Shrubs [1/m2]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>shrubs, up to 2 m high</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Saplings [1/m2]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>saplings below 7.5 cm DBH</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Logs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>logs lying about</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Slope [%]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>slope of the ground</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Roughness [m]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>standard deviation of the ground about its plane</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Image width [px]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>width of a photo</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Image height [px]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>height of a photo</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>number of photos, both flights together</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>rays a pixel</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Ground sample distance [cm]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>ground sample distance straight down from 70 m; sets the focal length</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Sun shift [min]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>minutes by which the sun moves on between the flights; 0 = same shadows in both</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Float epochs</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos that fall into a burst of PPK float solutions (0.3 m error)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>LiDAR density [1/m2]</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>LiDAR pulses per square metre; 0 = no cloud</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>the plot's folder</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>plot name used in the files</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos rendered</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>stems inside the plot</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>points of the LiDAR cloud</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>photos that see a stem's breast height free (median over the stems)</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Check the engine</source>
      <translation>Rechenkern prüfen</translation>
    </message>
    <message>
      <source>Say what is installed, which steps work and how to mend the rest.</source>
      <translation>Sagt, was installiert ist, welche Schritte laufen und wie der Rest zu beheben ist.</translation>
    </message>
    <message>
      <source>Loads every library of the engine, lists versions, cores, memory and disk, and says for each command whether it can run. Ends with an error and one sentence when something is missing.</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>Python version</source>
      <translation>Python-Version</translation>
    </message>
    <message>
      <source>processor cores</source>
      <translation>Prozessorkerne</translation>
    </message>
    <message>
      <source>memory, GB</source>
      <translation>Arbeitsspeicher, GB</translation>
    </message>
    <message>
      <source>free disk for temporary files, GB</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>libraries found</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>libraries with versions</source>
      <translation type="unfinished" />
    </message>
    <message>
      <source>in words</source>
      <translation>in Worten</translation>
    </message>
  </context>
</TS>
